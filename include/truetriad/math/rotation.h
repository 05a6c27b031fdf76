// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace truetriad {

/// The matrix [v]x of the cross product: [v]x u = v x u.
Eigen::Matrix3d Skew(const Eigen::Vector3d& vector);

/// Exp: the rotation by |vector| rad about `vector`. The result is exact up to rounding for every
/// length, including zero.
Eigen::Quaterniond RotationExp(const Eigen::Vector3d& vector_rad);

/// Log: the rotation vector of `rotation` (a unit quaternion), of length 0…pi; the inverse of
/// RotationExp. q and -q give the same vector. At half a turn, v and -v are both solutions, and
/// either may be returned.
Eigen::Vector3d RotationLog(const Eigen::Quaterniond& rotation);

/// The shortest rotation that takes the direction of `from` to that of `to`.
Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Right Jacobian of SO(3): Exp(v + d) = Exp(v) Exp(J_r(v) d) to first order in d.
/// Forster et al. 2017, eq. 8.
Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& vector_rad);

/// Inverse of RightJacobian: Log(Exp(v) Exp(d)) = v + J_r^-1(v) d to first order. Range: |v| < 2
/// pi.
Eigen::Matrix3d InverseRightJacobian(const Eigen::Vector3d& vector_rad);

}  // namespace truetriad
