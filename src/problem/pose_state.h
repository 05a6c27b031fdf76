// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace truetriad {

// What is unknown about the attitude of one pose.
enum class PoseKind {
  kHeld,       // known exactly, no unknown
  kDirection,  // seen by one vector sensor: direction of its field in the body, 2 dof
  kRotation,   // world <- body, 3 dof
};

// The quantities from which the mean rotation of readings around a moment is computed
// (rows/field_row.h).
struct Turning {
  double mean_s = 0.0, mean_square_s2 = 0.0;             // of the readings' times from the moment
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();  // constant rate that fits the turns best
  Eigen::Vector3d rate_raw = Eigen::Vector3d::Zero();    // the gyroscope's reading at that rate
};

// A quaternion x, y, z, w (Eigen's order), or a direction x, y, z, 0.
using PoseValues = std::array<double, 4>;

constexpr int AmbientSize(PoseKind kind) { return kind == PoseKind::kDirection ? 3 : 4; }
constexpr int TangentSize(PoseKind kind) {
  return kind == PoseKind::kHeld ? 0 : kind == PoseKind::kDirection ? 2 : 3;
}

inline PoseValues ValuesOf(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

// The state after a step in its tangent space: R <- R Exp(d), or a direction u <- u + T d with T
// from TangentBasis.
PoseValues After(PoseKind kind,
                 const PoseValues& values,
                 const Eigen::Ref<const Eigen::VectorXd>& tangent);

// Derivative of After by the tangent at zero: AmbientSize x TangentSize.
using PlusJacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 3>;
PlusJacobian PlusJacobianOf(PoseKind kind, const PoseValues& values);

// Two unit vectors that complete the unit vector `direction` to a right-handed frame.
Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& direction);

// Columns: the outward axis of a face of the six-face block, and two tangent axes of this face.
// Order of the faces: +x, -x, +y, ….
Eigen::Matrix3d FaceAxes(int face);

}  // namespace truetriad
