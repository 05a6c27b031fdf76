// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// `figure`, a static drawing of SpherePoints, with the data from which sphere.js draws a sphere in
/// its place that turns, where Plotly is in the page and the browser has WebGL. `figure` alone
/// where there are no points.
std::string SphereScene(const Calibration& calibration, Triad triad, const std::string& figure);

}  // namespace truetriad
