// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "line/line_data.h"

namespace truetriad::line {

/// An estimated variance, chi-square distributed with `dof` degrees of freedom, and its known part
/// that is not due to the process: sigma^2 of the process = variance - known.
struct Spread {
  double variance = kNotKnown;  ///< As observed.
  double dof = 0.0;
  double known = 0.0;  ///< Mean variance of the calibrations; 0: not subtracted.

  /// sqrt(variance - known), at least zero.
  double ProcessSigma() const;
  /// The interval of ProcessSigma: the chi-square interval of the observed variance, less `known`,
  /// whose own uncertainty is neglected, since it is a mean over all calibrations.
  Interval ProcessSigmaInterval(double confidence) const;
};

/// Variance of all values about their mean. Needs two values.
Spread OverallSpread(const Eigen::VectorXd& values);

/// Variance between successive values, at least two: (mean moving range / d2)^2, d2 = 2 / sqrt(pi).
///
/// Its degrees of freedom are those of a chi-distributed variable with the same relative variance,
/// 1 / (2 dof). For the mean of m moving ranges of normal values, each range correlated with the
/// next, this relative variance is
///
///   ((2 - 4/pi) m + 2 * 0.1628 (m - 1)) / (m^2 * 4/pi)
///
/// so that dof is about 0.61 m (Palm & Wheeler 1990).
Spread MovingRangeSpread(const Eigen::VectorXd& values);

/// The p-value, 0 to 1, of the Anderson-Darling test for a normal distribution with estimated mean
/// and variance, after D'Agostino & Stephens (1986), table 4.9; NaN for fewer than eight values or
/// if all are equal.
double AndersonDarlingP(const Eigen::VectorXd& values);

/// The values of one quantity for all units that have it, in the order of time, and its limits; an
/// infinite limit means no limit.
struct CapabilityInput {
  Eigen::VectorXd values = {};
  Eigen::VectorXd sigma = {};  ///< Standard uncertainty of each value; NaN: not known.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A standard deviation, and the capability indices that follow from it.
struct CapabilityIndices {
  Estimate sigma;
  double dof = 0.0;
  Estimate cp;   ///< (upper - lower) / (6 sigma); NaN unless both limits are set.
  Estimate cpk;  ///< Distance of the mean from the nearer limit / (3 sigma); NaN without limits.
  double expected_outside = kNotKnown;  ///< Share of units outside the limits if values are normal.
};

/// The distribution of a quantity over many units, relative to its limits.
///
/// Within: Cp and Cpk from the moving ranges of successive units. Overall: Pp and Ppk about the
/// mean of all units. Observed: as measured. Process: with the variance of the calibrations
/// subtracted, as if each unit were known exactly.
struct Capability {
  struct Pair {
    CapabilityIndices within, overall;
  };
  Eigen::Index units = 0;
  double mean = kNotKnown, lowest = kNotKnown, highest = kNotKnown;
  double calibration_sigma = kNotKnown;  ///< RMS over units; NaN unless known for every unit.
  Pair observed, process;                ///< process: NaN without calibration_sigma.
  double observed_outside = kNotKnown;   ///< Share of units outside the limits.
  double normality_p = kNotKnown;        ///< AndersonDarlingP; intervals assume normal values.
};

/// Intervals hold with `confidence`. Those of sigma and Cp are chi-square intervals; that of Cpk =
/// distance / (3 sigma) combines Student's interval of the distance and the chi-square interval of
/// sigma by MOVER (Zou, Donner 2008); for many units it approaches the usual interval of Bissell
/// (1990): Cpk -+ z sqrt(1 / (9 n) + Cpk^2 / (2 dof)).
Capability FindCapability(const CapabilityInput& input, double confidence = 0.95);

}  // namespace truetriad::line
