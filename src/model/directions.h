// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

namespace truetriad {

/// The direction `i` of `count` that are spread evenly over the sphere, the same every time: a
/// Fibonacci grid.
inline Eigen::Vector3d EvenDirection(int i, int count) {
  const double z = 1.0 - (2.0 * i + 1.0) / count;
  const double azimuth = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

}  // namespace truetriad
