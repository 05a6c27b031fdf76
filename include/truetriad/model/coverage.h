// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"

namespace truetriad {

/// How evenly the directions of one triad's poses cover the sphere.
struct Coverage {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d eigenvalues = Eigen::Vector3d::Zero();  ///< Of mean(u u^T), ascending; sum: 1.
  /// Radius of the largest cap without a direction. A direction does not cover its opposite: only
  /// both together determine the bias.
  double largest_gap_deg = 180.0;
};

/// Coverage by unit vectors u (body frame); the gap is found on a grid of 4.5 degrees. Without
/// directions: eigenvalues zero, gap 180.
Coverage DirectionCoverage(Triad triad, const std::vector<Eigen::Vector3d>& directions);

}  // namespace truetriad
