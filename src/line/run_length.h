// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad::line {

// Average run lengths: the mean number of points until a chart with the given limits gives an
// alarm, the alarming one included, when single values are independent and normal with σ = 1.

/// EWMA z_i = λ x_i + (1 - λ) z_(i-1), z_0 = 0, alarm where |z_i| > width * sqrt(λ / (2 - λ)).
/// `shift`: of the mean of x, from the first value on. Nyström's solution of the integral equation
/// of Crowder (1987). Limits that widen with time to these give a few alarms more on the way: at
/// λ = 0.1 a run length of 500 units becomes 488 ± 2.4 (40,000 charts), a longer one loses less.
double EwmaRunLength(double lambda, double width, double shift = 0.0);

/// The width with which EwmaRunLength(lambda, width) = run_length; at least 0.5.
double EwmaWidth(double lambda, double run_length);

}  // namespace truetriad::line
