// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// " (did you mean `X`?)" for the name that begins with `word`, else for the one at the least edit
/// distance; empty if that distance exceeds both two and a third of the letters of `word`.
std::string DidYouMean(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace truetriad
