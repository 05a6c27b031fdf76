// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

/// The greatest common divisor (Euclid) of the distances between values: the step of which they are
/// whole multiples. 0 where it is below a millionth or above a fiftieth of the largest distance, or
/// where fewer than six distances leave it to chance.
double CommonStep(const std::vector<double>& distances);

}  // namespace truetriad
