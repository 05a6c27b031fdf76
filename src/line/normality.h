// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace truetriad::line {

/// Probability that normal values would be as far from a normal distribution, by the statistic of
/// Anderson and Darling with mean and variance estimated; NaN of fewer than eight values, or where
/// they are all the same. p after D'Agostino & Stephens (1986), table 4.9, from 0 to 1.
double AndersonDarlingP(const Eigen::VectorXd& values);

}  // namespace truetriad::line
