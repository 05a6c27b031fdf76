// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "line/interval.h"

namespace truetriad::line {

/// A mean square times a factor, of either sign.
struct MeanSquareTerm {
  double factor = 0.0, mean_square = 0.0, dof = 0.0;
};

/// Interval of a variance component sum(factor * expected mean square), at most one factor of which
/// is negative, by the modified large-sample method: Graybill & Wang (1980) for sums, Ting,
/// Burdick, Graybill, Jeyaratnam & Lu (1990), eq. 2 to 5, for differences. Never below zero.
Interval VarianceInterval(const std::vector<MeanSquareTerm>& terms, double confidence);

}  // namespace truetriad::line
