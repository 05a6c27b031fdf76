// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/interval.h"
#include "line/line_data.h"

namespace truetriad::line {

struct TrendOptions {
  /// A tag with a number, against which parameters are looked at besides time; degC.
  std::string temperature_tag = "temperature";
};

/// How one parameter changes with time or temperature.
struct Trend {
  int parameter = 0;  // index in LineData::parameters
  int units = 0;
  double slope = 0.0;       // parameter's unit a day (a unit of the line, a degC: see TrendReport)
  double sigma = 0.0;       // of the slope, widened for autocorrelation
  double intercept = 0.0;   // at the first moment (the lowest temperature)
  double change = 0.0;      // slope times the range that the units span
  double p = 1.0;           // of no trend, Mann and Kendall's test
  double p_adjusted = 1.0;  // Holm's, over the parameters
  /// Variance of the test against that of independent values; 1: independent.
  double inflation = 1.0;
};

struct TrendReport {
  /// False: the moments of the units are unknown or all the same; slopes are per unit of the line.
  bool by_time = true;
  std::string first, last;  // moments of the units looked at
  std::vector<Trend> time;
  std::vector<Trend> temperature;  // empty: no unit's temperature is known
  /// Of the units' temperatures with time, by ranks (Spearman); NaN: one of them does not change.
  /// Far from 0 the two kinds of trends cannot be told apart.
  double temperature_with_time = kNotKnown;
};

/// Trends of each parameter over the units: slope by Theil and Sen, test by Mann and Kendall with
/// the variance of Hamed and Rao (1998) for autocorrelated values. Many units are taken together
/// to medians of at most 300 consecutive groups. Of several stations (tag "station") each one's
/// median is moved to that of all first.
TrendReport Trends(const LineData& data, const TrendOptions& options = {});

}  // namespace truetriad::line
