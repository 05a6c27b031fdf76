// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

/// The greatest common divisor (Euclid) of the distances between values: the step of which they are
/// whole multiples. 0 if it is below a millionth or above a fiftieth of the largest distance, or if
/// there are fewer than six distances, which may share a factor by chance.
double CommonStep(const std::vector<double>& distances);

}  // namespace truetriad
