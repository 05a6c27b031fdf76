// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace truetriad {

/// " (did you mean `X`?)" for the nearest of `known`, or nothing when none is near: more than a
/// third of the letters (at least two) would have to change.
std::string DidYouMean(std::string_view word, const std::vector<std::string_view>& known);

}  // namespace truetriad
