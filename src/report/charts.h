// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/calibrate/compare.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The figures of the HTML report, as inline SVG. Each is the empty string when there is nothing to
// draw.

/// Each limit as a bar: the worst value with ±2σ against what is allowed.
std::string LimitChart(const std::vector<LimitCheck>& limits);

/// Differences of two calibrations in σ, each with ±1, against ±2; entries without a σ are left
/// out.
std::string DifferenceChart(const std::vector<ComparisonEntry>& entries);

/// Correlation of the parameters that are free, as a lower triangle of cells.
std::string CorrelationChart(const NamedCovariance& covariance);

}  // namespace truetriad
