// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// What the solution leaves, as inline SVG; the empty string when there is nothing to draw. Points
// are thinned, of neighbours the extremes kept, so that a figure's size does not grow with the
// poses.

/// One sensor: what is left of each axis at each pose with ±3σ of the noise that weighted it, and
/// all against the quantiles of the normal distribution: the lengths of a vector, the axes of a
/// gyroscope at rest.
std::string ResidualChart(const std::vector<PoseResidual>& poses,
                          const std::optional<TriadCalibration>& sensor,
                          Triad triad);
/// What it shows, in words.
std::string ResidualCaption(Triad triad);

/// Turns: what was found less what was stated, ±2σ, and the error of each that was held out.
std::string TurnChart(const RestQuality& quality);
std::string TurnCaption(const RestQuality& quality);

}  // namespace truetriad
