// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

/// The greatest common divisor (Euclid) of distances between values: the largest step of which all
/// distances are whole multiples. 0 if this step is below a millionth or above a fiftieth of the
/// largest distance, or if fewer than six distances are nonzero, since so few distances may share a
/// factor by chance.
double CommonStep(const std::vector<double>& distances);

}  // namespace truetriad
