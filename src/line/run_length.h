// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad::line {

// Average run lengths: the mean number of points until a chart with the given limits gives an
// alarm, the alarming one included, when single values are independent and normal with σ = 1.

/// EWMA z_i = λ x_i + (1 - λ) z_(i-1), z_0 = 0, alarm where |z_i| > width * σ(z_i):
///
///   σ(z_i)^2 = λ / (2 - λ) (1 - (1 - λ)^(2 i)),
///
/// which are limits that widen with time to their final ones. `shift`: of the mean of x, from the
/// first value on. Nyström's solution of the integral equation of Crowder (1987), with the first
/// points stepped through one by one.
double EwmaRunLength(double lambda, double width, double shift = 0.0);

/// The same with the final limits from the first point on.
double EwmaRunLengthFixedLimits(double lambda, double width, double shift = 0.0);

/// The width with which EwmaRunLength(lambda, width) = run_length; at least 0.5.
double EwmaWidth(double lambda, double run_length);

}  // namespace truetriad::line
