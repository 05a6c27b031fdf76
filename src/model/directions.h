// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// Direction `i` of `count` directions that are spread evenly over the sphere. They form a
/// Fibonacci grid and are the same in every call.
inline Eigen::Vector3d EvenDirection(int i, int count) {
  const double z = 1.0 - (2.0 * i + 1.0) / count;
  const double azimuth = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

/// The largest cap of the sphere that contains none of the directions.
struct DirectionGap {
  Eigen::Vector3d middle = Eigen::Vector3d::UnitZ();
  double radius_deg = 180.0;
};

/// The largest gap between `directions` (unit vectors), with its middle on a grid of 4.5 degrees.
inline DirectionGap LargestGap(const std::vector<Eigen::Vector3d>& directions) {
  DirectionGap gap;
  if (directions.empty()) return gap;
  // Neighbours on the grid are sqrt(4 pi / 2000) = 4.5 deg apart.
  constexpr int kGrid = 2000;
  double smallest_cosine = 1.0;
  for (int i = 0; i < kGrid; ++i) {
    const Eigen::Vector3d point = EvenDirection(i, kGrid);
    double nearest = -1.0;
    for (const Eigen::Vector3d& direction : directions) {
      nearest = std::max(nearest, point.dot(direction));
    }
    if (nearest < smallest_cosine) smallest_cosine = nearest, gap.middle = point;
  }
  gap.radius_deg = std::acos(std::clamp(smallest_cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  return gap;
}

}  // namespace truetriad
