// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// " (did you mean `X`?)" for the name that begins with `word`, else for the one at the least edit
/// distance; empty when that exceeds a third of the letters of `word` (and two).
std::string DidYouMean(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace truetriad
