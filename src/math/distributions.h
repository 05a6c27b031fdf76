// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

// Thin, header-light doors to Boost.Math. All arguments in their mathematical range, else CHECK:
// probabilities strictly between 0 and 1, values >= 0 for chi-square and F, degrees of freedom > 0.
// dof2 of F and dof of Student may be infinite: the noise is known, not estimated. NormalCdf takes
// any value, and keeps its digits in the lower tail.

double NormalCdf(double value);
double NormalQuantile(double probability);
double ChiSquareCdf(double value, double dof);
double ChiSquareQuantile(double probability, double dof);
double FisherCdf(double value, double dof1, double dof2);
double FisherQuantile(double probability, double dof1, double dof2);
/// 1 - FisherCdf, with all its digits where that is small.
double FisherUpper(double value, double dof1, double dof2);
/// The value that is exceeded with `probability`.
double FisherUpperQuantile(double probability, double dof1, double dof2);
double StudentQuantile(double probability, double dof);

/// The median of |e| times this is the σ of normal e.
inline constexpr double kMadToSigma = 1.4826;

/// σ of normal values about zero, by the median of their sizes; 0 of none.
double MadSigma(std::vector<double> values);

/// The value that `share` (0 to 1) of the others reach at most: one of them, the lower where it
/// lies between two. At least one value, none NaN.
double LowerQuantile(std::vector<double> values, double share);

/// The middle value, or the mean of the two in the middle. At least one value, none NaN.
double Median(std::vector<double> values);

}  // namespace truetriad
