// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <ceres/rotation.h>

#include "problem/parameters.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// The vector that a triad at rest senses in the frame of the attitudes, from the reference block
// (ReferenceIndex): specific force (0, 0, g), or the field B (cos dip cos heading, cos dip sin
// heading, -sin dip). A fixture's tilt t turns the level vector v into Exp(-t) v.
template <typename T>
Eigen::Matrix<T, 3, 1> WorldVectorOf(Triad triad, const T* reference) {
  using std::cos;
  using std::sin;
  Eigen::Matrix<T, 3, 1> level(T(0), T(0), reference[kGravity]);
  if (triad == Triad::kMagnetometer) {
    const T horizontal = reference[kField] * cos(reference[kDip]);
    level << horizontal * cos(reference[kHeading]), horizontal * sin(reference[kHeading]),
        -reference[kField] * sin(reference[kDip]);
  }
  const T tilt[3] = {-reference[kFixtureTilt], -reference[kFixtureTilt + 1], T(0)};
  Eigen::Matrix<T, 3, 1> world;
  ceres::AngleAxisRotatePoint(tilt, level.data(), world.data());
  return world;
}

// The earth's rate in the frame of the attitudes: rotated about the vertical by the heading of
// magnetic north, then by the fixture's tilt, like the field.
template <typename T>
Eigen::Matrix<T, 3, 1> EarthRateOf(const Eigen::Vector3d& earth_rate_radps, const T* reference) {
  using std::cos;
  using std::sin;
  const T c = cos(reference[kHeading]), s = sin(reference[kHeading]);
  const T x(earth_rate_radps.x()), y(earth_rate_radps.y());
  const Eigen::Matrix<T, 3, 1> level(c * x - s * y, s * x + c * y, T(earth_rate_radps.z()));
  const T tilt[3] = {-reference[kFixtureTilt], -reference[kFixtureTilt + 1], T(0)};
  Eigen::Matrix<T, 3, 1> world;
  ceres::AngleAxisRotatePoint(tilt, level.data(), world.data());
  return world;
}

// The vector of a triad with its derivative by the reference block. Each thread caches the last
// result of each triad, since all rows of a graph share one reference.
struct WorldVectorWithJacobian {
  Eigen::Vector3d vector;
  Eigen::Matrix<double, 3, kReferenceSize> by_reference;
};
const WorldVectorWithJacobian& WorldVectorAt(Triad triad, const double* reference);

}  // namespace truetriad
