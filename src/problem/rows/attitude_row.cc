// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/attitude_row.h"

namespace truetriad {

bool AttitudeRow::Evaluate(double const* const* parameters,
                           double* residuals,
                           double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  Eigen::Map<RowMajor34>{jacobians[0]} =
      InverseRightJacobian(Eigen::Map<const Eigen::Vector3d>(residuals)) *
      TangentFromQuaternion(parameters[0]);
  return true;
}

bool HeldHeadingRow::Evaluate(double const* const* parameters,
                              double* residuals,
                              double** jacobians) const {
  const Eigen::Quaterniond attitude(parameters[0]);
  const Eigen::Vector3d log = RotationLog(attitude * held_.conjugate());
  residuals[0] = log.z();
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  // R Exp(d) R_held^T = Exp(R d) R R_held^T, and the inverse left Jacobian is the transpose of the
  // right one.
  const Eigen::RowVector3d by_tangent =
      InverseRightJacobian(log).col(2).transpose() * attitude.toRotationMatrix();
  Eigen::Map<Eigen::RowVector4d>{jacobians[0]} = by_tangent * TangentFromQuaternion(parameters[0]);
  return true;
}

}  // namespace truetriad
