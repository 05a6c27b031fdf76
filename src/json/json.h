// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

namespace truetriad {

/// JSON whose members stay in the order in which they were added. Numbers that are none (NaN,
/// infinity) become null.
using Json = nlohmann::ordered_json;

}  // namespace truetriad
