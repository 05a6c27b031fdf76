// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad::line {

/// Probabilities of many tests, each adjusted so that with nothing to find one is below α with a
/// probability of at most α: Holm's (1979) steps, whatever the tests depend on each other.
std::vector<double> HolmAdjusted(const std::vector<double>& p);

}  // namespace truetriad::line
