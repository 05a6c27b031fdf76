// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "line/line_data.h"

namespace truetriad::line {

/// An estimated variance, distributed as chi-square with `dof` degrees of freedom. Its part `known`
/// comes from the calibrations, not from the process: sigma^2 of the process = variance - known.
struct Spread {
  double variance = kNotKnown;  ///< Of the observed values.
  double dof = 0.0;
  double known = 0.0;  ///< Mean variance of the calibrations; 0: it is not subtracted.

  /// sqrt(variance - known), at least zero.
  double ProcessSigma() const;
  /// The interval of ProcessSigma: the chi-square interval of `variance` less `known`. The
  /// uncertainty of `known` is neglected, since `known` is a mean over all calibrations.
  Interval ProcessSigmaInterval(double confidence) const;
};

/// Variance of all values about their mean. Needs at least two values.
Spread OverallSpread(const Eigen::VectorXd& values);

/// Variance from the differences of successive values: (mean moving range / d2)^2 with d2 = 2 /
/// sqrt(pi). Needs at least two values.
///
/// The degrees of freedom are those of a chi-distributed sigma with the same relative variance, 1 /
/// (2 dof). The mean of m moving ranges of normal values has the relative variance
///
///   ((2 - 4/pi) m + 2 * 0.1628 (m - 1)) / (m^2 * 4/pi)
///
/// since each range is correlated with the next. So dof is about 0.61 m (Palm & Wheeler 1990).
Spread MovingRangeSpread(const Eigen::VectorXd& values);

/// The p-value, 0 to 1, of the Anderson-Darling test for a normal distribution with estimated mean
/// and variance (D'Agostino & Stephens 1986, table 4.9). If there are fewer than eight values, or
/// all values are equal, it is NaN.
double AndersonDarlingP(const Eigen::VectorXd& values);

/// One quantity: its values for all units that have it, in the order of time, and its limits. An
/// infinite limit means that there is none.
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
/// `within`: Cp and Cpk, with sigma from the moving ranges of successive units. `overall`: Pp and
/// Ppk, with sigma about the mean of all units. `observed`: as measured. `process`: the variance of
/// the calibrations is subtracted, as if the value of each unit were known exactly.
struct Capability {
  struct Pair {
    CapabilityIndices within, overall;
  };
  Eigen::Index units = 0;
  double mean = kNotKnown, lowest = kNotKnown, highest = kNotKnown;
  double calibration_sigma = kNotKnown;  ///< RMS over units; NaN unless every unit has a sigma.
  Pair observed, process;                ///< `process` is NaN without calibration_sigma.
  double observed_outside = kNotKnown;   ///< Share of units outside the limits.
  double normality_p = kNotKnown;        ///< AndersonDarlingP; intervals assume normal values.
};

/// Intervals hold with `confidence`. Sigma and Cp have chi-square intervals. For Cpk = distance /
/// (3 sigma), MOVER (Zou, Donner 2008) combines Student's interval of the distance and the
/// chi-square interval of sigma. For many units the interval of Cpk approaches the usual one of
/// Bissell (1990): Cpk -+ z sqrt(1 / (9 n) + Cpk^2 / (2 dof)).
Capability FindCapability(const CapabilityInput& input, double confidence = 0.95);

}  // namespace truetriad::line
