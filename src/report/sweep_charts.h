// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The figures of a temperature sweep, as inline SVG; the empty string when there is nothing to
// draw.

/// One axis: windows against temperature with the fit and ±2σ about it, and over time what the fit
/// leaves.
std::string SweepFitChart(const Calibration& calibration, Triad triad, int axis);

/// Whether a lag of the axis is so long that its bias at a temperature and a rate depends on what
/// was before.
bool FollowsThePast(const Calibration& calibration, Triad triad, int axis);

/// One axis: the bias over temperature and its rate, as coloured cells. Nothing where it follows
/// the past.
std::string SweepSurfaceChart(const Calibration& calibration, Triad triad, int axis);

}  // namespace truetriad
