// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/content.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// What the poses at each temperature say by themselves, against the temperature terms, and the
/// errors with and without those. Empty for calibrations without settings of temperature.
Section SoakSection(const Calibration& calibration);

/// One axis as inline SVG: the bias that the poses of each temperature show by themselves, ±2σ,
/// with what the terms say, ±2σ; beside it the difference. Empty where there is nothing to draw.
std::string SoakChart(const Calibration& calibration, Triad triad, int axis);

}  // namespace truetriad
