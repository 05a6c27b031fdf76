// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// Reads a scenario (`scenario: 1`), docs/simulation.md, and converts its quantities from the units
/// of data sheets to those of sim/scenario.h.
///
/// `base:` names a scenario whose keys hold unless the scenario itself states them; lists (motion,
/// disturbances) replace those of the base as a whole. `overrides` are `key.sub=value` pairs (the
/// `--set` flag), the value in YAML flow style, read after both. Paths are relative to the file
/// that names them; paths in overrides, to `path`. Errors (bad input), all at once: unknown and
/// duplicate keys, wrong types and values out of range, with file:line or the override; a quantity
/// stated in two units; values that contradict each other.
Result<Scenario> ReadScenario(const std::string& path,
                              const std::vector<std::string>& overrides = {});

/// As ReadScenario, for the text of a scenario whose path would be `path`.
Result<Scenario> ReadScenarioText(const std::string& text,
                                  const std::string& path,
                                  const std::vector<std::string>& overrides = {});

}  // namespace truetriad
