// SPDX-License-Identifier: Apache-2.0
#include "truetriad/math/rotation.h"

#include <cmath>

namespace truetriad {
namespace {

// Below this angle the closed forms cancel and their series are exact to rounding.
constexpr double kSmallAngle = 1e-2;

}  // namespace

Eigen::Matrix3d Skew(const Eigen::Vector3d& vector) {
  Eigen::Matrix3d skew;
  skew << 0.0, -vector.z(), vector.y(), vector.z(), 0.0, -vector.x(), -vector.y(), vector.x(), 0.0;
  return skew;
}

Eigen::Quaterniond RotationExp(const Eigen::Vector3d& vector_rad) {
  const double square = vector_rad.squaredNorm();
  Eigen::Quaterniond rotation;
  // sin(a / 2) / a and cos(a / 2); readings of a gyroscope turn by little at a time.
  constexpr double kSeries = 0.04;
  if (square < kSeries) {
    const double h = 0.25 * square;
    rotation.vec() =
        (0.5 - 0.5 * h * (1.0 / 6.0 - h * (1.0 / 120.0 - h * (1.0 / 5040.0 - h / 362880.0)))) *
        vector_rad;
    rotation.w() =
        1.0 -
        h * (0.5 - h * (1.0 / 24.0 - h * (1.0 / 720.0 - h * (1.0 / 40320.0 - h / 3628800.0))));
  } else {
    const double angle = std::sqrt(square);
    rotation.vec() = std::sin(0.5 * angle) / angle * vector_rad;
    rotation.w() = std::cos(0.5 * angle);
  }
  return rotation;
}

Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d vector = sign * rotation.vec();
  const double norm = vector.norm();
  // atan2(s, c) / s -> 1 for s -> 0, and is exact to rounding below this norm.
  if (norm < 1e-9) return 2.0 * vector;
  return 2.0 * std::atan2(norm, sign * rotation.w()) / norm * vector;
}

// Apart, as Eigen's brings a singular value decomposition along.
Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& vector_rad) {
  const double angle = vector_rad.norm(), square = angle * angle;
  const Eigen::Matrix3d skew = Skew(vector_rad);
  // (1 - cos a) / a^2 and (a - sin a) / a^3.
  const double first = angle < kSmallAngle ? 0.5 - square * (1.0 / 24.0 - square / 720.0)
                                           : (1.0 - std::cos(angle)) / square;
  const double second = angle < kSmallAngle ? 1.0 / 6.0 - square * (1.0 / 120.0 - square / 5040.0)
                                            : (angle - std::sin(angle)) / (square * angle);
  return Eigen::Matrix3d::Identity() - first * skew + second * skew * skew;
}

Eigen::Matrix3d InverseRightJacobian(const Eigen::Vector3d& vector_rad) {
  const double angle = vector_rad.norm();
  const Eigen::Matrix3d skew = Skew(vector_rad);
  // 1/a^2 - (1 + cos a) / (2 a sin a), written so that half a turn divides by no zero.
  const double factor = angle < kSmallAngle
                            ? 1.0 / 12.0 + angle * angle / 720.0
                            : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * skew + factor * skew * skew;
}

}  // namespace truetriad
