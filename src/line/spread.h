// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "line/interval.h"

namespace truetriad::line {

/// A variance with the degrees of freedom of the chi-square that it is distributed like, and with
/// a known part of it that is not the process': sigma^2 of the process = variance - known.
struct Spread {
  double variance = kNotKnown;  ///< As observed.
  double dof = 0.0;
  double known = 0.0;  ///< Of the calibration, in the mean; 0: left in.

  /// Of the process, never below zero.
  double ProcessSigma() const;
  /// The interval of that: chi-square's of the observed variance, less what is known. The known
  /// part has the degrees of freedom of all calibrations together, so its own doubt is left out.
  Interval ProcessSigmaInterval(double confidence) const;
};

/// Of all values about their mean. Needs two.
Spread OverallSpread(const Eigen::VectorXd& values);

/// Between values that follow each other: the mean moving range over d2 = 2 / sqrt(pi). Needs two.
///
/// Degrees of freedom are those of the chi-square whose root has the same relative variance,
/// 1 / (2 dof); that of the mean of m moving ranges of normal values, each correlated with the
/// next:
///
///   ((2 - 4/pi) m + 2 * 0.1628 (m - 1)) / (m^2 * 4/pi)
///
/// about 0.61 m (Palm & Wheeler 1990).
Spread MovingRangeSpread(const Eigen::VectorXd& values);

/// Within groups of one name, pooled. Needs a group of two.
Spread SubgroupSpread(const Eigen::VectorXd& values, const std::vector<std::string>& groups);

}  // namespace truetriad::line
