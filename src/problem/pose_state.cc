// SPDX-License-Identifier: Apache-2.0
#include "problem/pose_state.h"

#include "truetriad/math/rotation.h"

namespace truetriad {

PoseValues After(PoseKind kind,
                 const PoseValues& values,
                 const Eigen::Ref<const Eigen::VectorXd>& tangent) {
  if (kind == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(values.data());
    const Eigen::Vector3d moved =
        (direction + TangentBasis(direction) * tangent.head<2>()).normalized();
    return {moved.x(), moved.y(), moved.z(), 0.0};
  }
  if (kind == PoseKind::kRotation) {
    const Eigen::Map<const Eigen::Quaterniond> rotation(values.data());
    return ValuesOf((rotation * RotationExp(Eigen::Vector3d(tangent.head<3>()))).normalized());
  }
  return values;
}

PlusJacobian PlusJacobianOf(PoseKind kind, const PoseValues& values) {
  PlusJacobian jacobian(AmbientSize(kind), TangentSize(kind));
  if (kind == PoseKind::kDirection) {
    jacobian = TangentBasis(Eigen::Map<const Eigen::Vector3d>(values.data()));
  } else if (kind == PoseKind::kRotation) {
    // Derivative of q (d / 2, 1) by d; TangentFromQuaternion is its left inverse.
    const Eigen::Map<const Eigen::Quaterniond> q(values.data());
    jacobian << 0.5 * (q.w() * Eigen::Matrix3d::Identity() + Skew(q.vec())),
        -0.5 * q.vec().transpose();
  }
  return jacobian;
}

Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& direction) {
  Eigen::Index smallest = 0;
  direction.cwiseAbs().minCoeff(&smallest);
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

Eigen::Matrix3d FaceAxes(int face) {
  const int axis = face / 2;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  axes(axis, 0) = face % 2 == 0 ? 1.0 : -1.0;
  axes((axis + 1) % 3, 1) = 1.0;
  axes((axis + 2) % 3, 2) = 1.0;
  return axes;
}

}  // namespace truetriad
