// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "line/line_data.h"

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

/// Probability that normal values would be as far from a normal distribution, by the statistic of
/// Anderson and Darling with mean and variance estimated; NaN of fewer than eight values, or where
/// they are all the same. p after D'Agostino & Stephens (1986), table 4.9, from 0 to 1.
double AndersonDarlingP(const Eigen::VectorXd& values);

/// One quantity of all units that have it, in the order of time, and what it may be; a side that is
/// infinite is open.
struct CapabilityInput {
  Eigen::VectorXd values = {};
  Eigen::VectorXd sigma = {};  ///< Of each unit's calibration; NaN: not known.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A spread, and the limits in its terms.
struct CapabilityIndices {
  Estimate sigma;
  double dof = 0.0;
  Estimate cp;   ///< (upper - lower) / (6 sigma); NaN unless both limits are set.
  Estimate cpk;  ///< Distance of the mean from the nearer limit / (3 sigma); NaN without limits.
  double expected_outside = kNotKnown;  ///< Share of units, were they normal.
};

/// How a quantity of many units lies within its limits.
///
/// Within: Cp and Cpk, from the moving ranges of successive units. Overall: Pp
/// and Ppk, about the mean of all. Observed: as measured; process: the same with the variance of
/// the calibrations taken out, which is what the units would show if each were known exactly.
struct Capability {
  struct Pair {
    CapabilityIndices within, overall;
  };
  Eigen::Index units = 0;
  double mean = kNotKnown, lowest = kNotKnown, highest = kNotKnown;
  double calibration_sigma = kNotKnown;  ///< RMS of the units'; NaN: not known of each.
  Pair observed, process;                ///< process: NaN without calibration_sigma.
  double observed_outside = kNotKnown;   ///< Share of units.
  double normality_p = kNotKnown;        ///< AndersonDarlingP; all above but shares assume it.
};

/// Intervals hold with `confidence`. That of a spread is chi-square's (spread.h), and so is that of
/// Cp; that of Cpk = distance / (3 sigma) is put together from Student's of the distance and
/// chi-square's of sigma by MOVER (Zou, Donner 2008), which for many units is the usual one of
/// Bissell (1990): Cpk -+ z sqrt(1 / (9 n) + Cpk^2 / (2 dof)).
Capability FindCapability(const CapabilityInput& input, double confidence = 0.95);

}  // namespace truetriad::line
