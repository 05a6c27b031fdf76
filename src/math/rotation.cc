// SPDX-License-Identifier: Apache-2.0
#include "truetriad/math/rotation.h"

#include <cmath>

namespace truetriad {
namespace {

// Angle a, rad: for smaller angles the closed form loses digits by cancellation, and a series is
// used; its next term, a^4 / 30240, is below 1e-12.
constexpr double kSmallAngle = 1e-2;
// Square of 0.2 rad: for smaller angles, series of four or five terms are exact to 3e-15 without
// sine and cosine; a gyroscope turns by less from one reading to the next.
constexpr double kSeries = 0.04;

}  // namespace

Eigen::Matrix3d Skew(const Eigen::Vector3d& vector) {
  Eigen::Matrix3d skew;
  skew << 0.0, -vector.z(), vector.y(), vector.z(), 0.0, -vector.x(), -vector.y(), vector.x(), 0.0;
  return skew;
}

Eigen::Quaterniond RotationExp(const Eigen::Vector3d& vector_rad) {
  const double square = vector_rad.squaredNorm();
  Eigen::Quaterniond rotation;
  // sin(a / 2) / a and cos(a / 2).
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
  // atan2(s, c) / s tends to 1 for s -> 0; for a smaller norm, this differs from 1 by less than
  // rounding.
  if (norm < 1e-9) return 2.0 * vector;
  return 2.0 * std::atan2(norm, sign * rotation.w()) / norm * vector;
}

// Compiled once, since Eigen's function includes a singular value decomposition.
Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& vector_rad) {
  const double s = vector_rad.squaredNorm();
  // (1 - cos a) / a^2 and (a - sin a) / a^3.
  double first, second;
  if (s < kSeries) {
    first = 0.5 - s * (1.0 / 24.0 - s * (1.0 / 720.0 - s * (1.0 / 40320.0 - s / 3628800.0)));
    second = 1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0 - s * (1.0 / 362880.0)));
  } else {
    const double angle = std::sqrt(s);
    first = (1.0 - std::cos(angle)) / s;
    second = (angle - std::sin(angle)) / (s * angle);
  }
  // I - first [v] + second [v]^2, [v]^2 being v v^T - a^2 I.
  const Eigen::Vector3d scaled = first * vector_rad, along = second * vector_rad;
  const double own = 1.0 - second * s;
  const double xy = along.x() * vector_rad.y(), xz = along.x() * vector_rad.z(),
               yz = along.y() * vector_rad.z();
  Eigen::Matrix3d jacobian;
  jacobian << own + along.x() * vector_rad.x(), xy + scaled.z(), xz - scaled.y(),  //
      xy - scaled.z(), own + along.y() * vector_rad.y(), yz + scaled.x(),          //
      xz + scaled.y(), yz - scaled.x(), own + along.z() * vector_rad.z();
  return jacobian;
}

Eigen::Matrix3d InverseRightJacobian(const Eigen::Vector3d& vector_rad) {
  const double angle = vector_rad.norm();
  const Eigen::Matrix3d skew = Skew(vector_rad);
  // 1 / a^2 - (1 + cos a) / (2 a sin a), in a form without the division by sin a, zero at half a
  // turn.
  const double factor = angle < kSmallAngle
                            ? 1.0 / 12.0 + angle * angle / 720.0
                            : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * skew + factor * skew * skew;
}

}  // namespace truetriad
