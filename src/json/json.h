// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace truetriad {

/// JSON whose members stay in the order in which they were added. Numbers that are none (NaN,
/// infinity) become null.
using Json = nlohmann::ordered_json;

/// As it is printed and written: UTF-8, what is none (a file name, say) replaced.
inline std::string TextOf(const Json& json) {
  return json.dump(1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + '\n';
}

}  // namespace truetriad
