// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/face_row.h"

#include "problem/rows/attitude.h"

namespace truetriad {

FaceRow::FaceRow(int face, const SharedBlock& tilt, PoseKind state)
    : Row(2), tangents_(FaceAxes(face).rightCols<2>()), state_(state) {
  AddShared(tilt);
  AddState(state == PoseKind::kDirection ? kDirectionSize : kAttitudeSize);
}

bool FaceRow::Evaluate(double const* const* parameters,
                       double* residuals,
                       double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>>{jacobians[0]} =
        -Eigen::Matrix2d::Identity();
  }
  if (jacobians[1] == nullptr) return true;
  if (state_ == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> up(parameters[1]);
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{jacobians[1]} =
        tangents_.transpose() * (Eigen::Matrix3d::Identity() - up * up.transpose());
  } else {
    const Eigen::Map<const Eigen::Quaterniond> attitude(parameters[1]);
    const Eigen::Vector3d up = attitude.conjugate() * Eigen::Vector3d::UnitZ();
    Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>>{jacobians[1]} =
        tangents_.transpose() * Skew(up) * TangentFromQuaternion(parameters[1]);
  }
  return true;
}

}  // namespace truetriad
