// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// " (did you mean `X`?)": X is the first name that begins with `word`, if that has three letters;
/// else the name with the least edit distance from `word`. Empty if that distance is larger than
/// both two and a third of the length of `word`, or is not below that length.
std::string DidYouMean(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace truetriad
