// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

// Wrappers of Boost.Math that keep its headers out of other files. Arguments outside their range
// fail a CHECK: probabilities lie strictly between 0 and 1, values of chi-square and F are >= 0,
// degrees of freedom > 0. The dof2 of FisherCdf and FisherQuantile and the dof of StudentQuantile
// may be infinite: the noise is then known, not estimated. NormalCdf keeps its digits in the lower
// tail.

double NormalCdf(double value);
double NormalQuantile(double probability);
double ChiSquareCdf(double value, double dof);
double ChiSquareQuantile(double probability, double dof);
double FisherCdf(double value, double dof1, double dof2);
double FisherQuantile(double probability, double dof1, double dof2);
/// 1 - FisherCdf, accurate even where it is small; dof2 must be finite.
double FisherUpper(double value, double dof1, double dof2);
/// The value that is exceeded with `probability`; dof2 is finite.
double FisherUpperQuantile(double probability, double dof1, double dof2);
double StudentQuantile(double probability, double dof);

/// The σ of normal e is this times the median of |e|: 1 / Φ^-1(3/4).
inline constexpr double kMadToSigma = 1.4826;

/// σ of normal values of mean zero, from the median of their absolute values; 0 without values.
double MadSigma(std::vector<double> values);

/// The quantile at `share` (0 to 1). If it lies between two values, the lower value is returned.
/// There is at least one value and none is NaN.
double LowerQuantile(std::vector<double> values, double share);

/// The middle value, or the mean of the two values in the middle. There is at least one value and
/// none is NaN.
double Median(std::vector<double> values);

}  // namespace truetriad
