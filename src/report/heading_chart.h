// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/model/calibration.h"

namespace truetriad {

/// What a compass is off by round the horizon, before and after, as inline SVG; the empty string
/// without accelerometer and magnetometer.
std::string HeadingChart(const Calibration& calibration);

}  // namespace truetriad
