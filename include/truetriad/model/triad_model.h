// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace truetriad {

/// One triad: what the chip reports for a true field, and back.
///
///   raw   = sensitivity * truth + bias             what the chip does
///   truth = correction * (raw - bias)              what we ship; correction = sensitivity^-1
///
/// Frame: truth is in the body frame; row i of sensitivity is sensing axis i there. Stored
/// column-major (Eigen).
/// Units: truth in m/s^2, rad/s or uT; raw and bias in the log's unit; sensitivity in raw per true
/// unit.
/// Gauge: static poses cannot see a common rotation of all rows; see gauge.h for which convention
/// holds.
template <typename Scalar>
struct TriadModel {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Matrix3 sensitivity = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();

  Vector3 RawFromTruth(const Vector3& truth) const { return sensitivity * truth + bias; }

  /// Undefined (infinities) when the sensitivity is singular.
  Vector3 TruthFromRaw(const Vector3& raw) const { return Correction() * (raw - bias); }

  Matrix3 Correction() const { return sensitivity.inverse(); }
};

}  // namespace truetriad
