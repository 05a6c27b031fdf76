// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/line_data.h"

namespace truetriad::line {

/// How one parameter changes from the first unit to the last.
struct Trend {
  int parameter = 0;  // index in LineData::parameters
  int units = 0;
  double change = 0.0;      // of the line over all units' span; parameter's unit
  double sigma = 0.0;       // of that, widened for autocorrelation
  double p = 1.0;           // of no trend, Student's
  double p_adjusted = 1.0;  // Holm's, over the parameters
  /// Variance of the change against that of independent units; 1: independent.
  double inflation = 1.0;
};

struct TrendReport {
  std::string first, last;  // moments between which the changes are; empty: none is known
  std::vector<Trend> trends;
  std::string note;  // why there are none, or which units have no part in them; empty: nothing
};

/// Straight lines through each parameter over the time of measurement, by least squares. A unit
/// that inherits a part ρ of the one before makes the variance of the change greater by
/// (1 + ρ) / (1 - ρ). Of several stations (tag "station") each one's median is moved to that of
/// all first. Units whose time is not known, and outliers, have no part.
TrendReport Trends(const LineData& data);

}  // namespace truetriad::line
