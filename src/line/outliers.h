// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/line_data.h"

namespace truetriad::line {

struct OutlierOptions {
  /// Probability that units without a fault have an outlier among them.
  double level = 0.01;
  /// Parameters named of each outlier, at most.
  int most_parameters = 5;
};

/// How much one parameter makes a unit an outlier.
struct OutlierShare {
  int parameter = 0;         // index in LineData::parameters
  double deviation = 0.0;    // from the centre, in robust σ
  double conditional = 0.0;  // from what the unit's other parameters let expect, in σ of that
};

struct Outlier {
  int unit = 0;           // index in LineData::units
  double distance = 0.0;  // Mahalanobis
  double p = 1.0;
  double p_adjusted = 1.0;           // for the number of units of all sets (Sidak)
  std::vector<OutlierShare> shares;  // by |conditional|, largest first
};

/// Units that were held against each other.
struct OutlierSet {
  std::vector<std::string> stations;  // that they are of
  int units = 0;                      // with values of all parameters used
  std::vector<int> parameters;        // used: neither constant nor determined by others
  std::vector<double> centre, sigma;  // robust, of `parameters`
  double limit = 0.0;                 // distance beyond which p_adjusted < level
};

struct OutlierReport {
  std::vector<OutlierSet> sets;
  std::vector<double> distances;   // of each of LineData::units; NaN: not judged
  std::vector<Outlier> outliers;   // largest distance first
  std::vector<std::string> notes;  // units not judged, parameters left out that vary, and why
};

/// Units that are unlike the others over all parameters together: Mahalanobis distances from a
/// robust centre and covariance, which a quarter of the units cannot spoil. Stations whose units
/// have the same parameters are judged together, each unit once; those that lack some of these,
/// among themselves.
OutlierReport Outliers(const LineData& data, const OutlierOptions& options = {});

}  // namespace truetriad::line
