// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// " (did you mean `X`?)": if `word` has at least three letters, X is the first name that begins
/// with `word`. Otherwise X is the name with the least edit distance from `word`. The text is empty
/// if this distance exceeds both two and a third of the length of `word`, or is not below this
/// length.
std::string DidYouMean(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace truetriad
