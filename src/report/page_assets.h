// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace truetriad {

// What is in src/report/assets.

/// report.css.
std::string_view PageStyle();
/// report.js.
std::string_view PageScript();
/// "sha256-…": by which a page's policy allows the script that is in it.
std::string_view PageScriptHash();

}  // namespace truetriad
