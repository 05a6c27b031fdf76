// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/model/calibration.h"

namespace truetriad {

// The figures of the HTML report, as inline SVG. Each is the empty string when there is nothing to
// draw. Points are thinned, so that a figure's size does not grow with the number of poses.

/// Each limit as a bar: the worst value with ±2σ against what is allowed.
std::string LimitChart(const std::vector<LimitCheck>& limits);

/// Norm error of one triad over the poses: before (when known) and after, each on its own scale.
/// `sigma`: σ of the norm error from the noise, true unit, drawn as a ±2σ band; none when zero.
std::string ResidualChart(const Quality& quality, Triad triad, double sigma);

/// Directions of one triad's poses on two Lambert equal-area discs: z up and z down.
std::string CoverageChart(const Quality& quality, Triad triad);

/// Correlation of the parameters that are free, as a lower triangle of cells.
std::string CorrelationChart(const NamedCovariance& covariance);

}  // namespace truetriad
