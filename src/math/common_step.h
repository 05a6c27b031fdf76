// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

/// The step that values are whole multiples of, by the distances between them: their greatest
/// common divisor (Euclid). 0 where they have none above a millionth of the largest, or too few of
/// them or too coarse a step to tell it from chance.
double CommonStep(const std::vector<double>& distances);

}  // namespace truetriad
