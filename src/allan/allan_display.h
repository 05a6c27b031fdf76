// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/allan/allan.h"

namespace truetriad {

/// The unit that people are shown: the recording's, or for counts of known scale a common one.
struct AllanScale {
  double shown_per_raw = 1.0;
  std::string unit;  ///< "deg/s", "m/s²", "µT", "counts".
};
AllanScale ShownScale(const AllanTriad& triad);

/// One coefficient of one axis as it is shown, in text and in the plot alike.
struct AllanCoefficient {
  char symbol = 'N';
  Interval value;    ///< Shown unit.
  std::string unit;  ///< "deg/s/√Hz".
  bool upper_bound = false;
  double slope = 0.0;       ///< Of its line in the plot.
  double mark_tau_s = 1.0;  ///< Where the line is marked.
  double mark = 0.0;        ///< Deviation of the line there, shown unit.
};
/// Those that the data show, in the order N, B, K, Q.
std::vector<AllanCoefficient> Coefficients(const AllanAxis& axis, const AllanScale& scale);

/// Four significant digits; "≤ " before a bound.
std::string ValueText(const AllanCoefficient& coefficient);
std::string AllanNumber(double value);

}  // namespace truetriad
