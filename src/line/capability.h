// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "line/interval.h"

namespace truetriad::line {

/// One quantity of all units that have it, in the order of time, and what it may be; a side that is
/// infinite is open.
struct CapabilityInput {
  Eigen::VectorXd values = {};
  Eigen::VectorXd sigma = {};               ///< Of each unit's calibration; NaN: not known.
  std::vector<std::string> subgroups = {};  ///< By unit; empty: successive units are one.
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
/// Within: Cp and Cpk, from the moving ranges of successive units or within subgroups. Overall: Pp
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
