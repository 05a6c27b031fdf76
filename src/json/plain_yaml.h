// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "json/json.h"

namespace truetriad {

/// The same tree as JSON: names, values and order of a YAML text that this program wrote.
///
/// Made for what io/yaml_text.h and the resolved experiment look like: blocks by indentation, `- `
/// items, lists and maps in brackets within a line, double-quoted or plain words, comments. A
/// general reader would take longer over a calibration than its estimate (tests/json compares).
/// `text` must be such a text: anything else ends the program.
Json JsonOfPlainYaml(std::string_view text);

}  // namespace truetriad
