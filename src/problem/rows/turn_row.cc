// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/turn_row.h"

namespace truetriad {

TurnRow::TurnRow(const SharedLayout& layout,
                 const ThermalFactors& factors,
                 bool counts_earth_rate,
                 const GyroModel* at,
                 const GyroIncrement* increment)
    : Row(3),
      at_(at),
      increment_(increment),
      earth_rate_radps_(layout.earth_rate_radps),
      counts_earth_rate_(counts_earth_rate),
      has_g_sensitivity_(layout.g_sensitivity >= 0),
      triad_blocks_(layout, Triad::kGyroscope, factors) {
  AddFirstShared(triad_blocks_.blocks(), 2);
  if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
  if (counts_earth_rate_) AddShared({layout.reference, kReferenceSize});
  AddState(kAttitudeSize);
  AddState(kAttitudeSize);
}

bool TurnRow::Evaluate(double const* const* parameters,
                       double* residuals,
                       double** jacobians) const {
  const Parts<double> parts = PartsOf(parameters);
  const Eigen::Vector3d change = ChangeOf(parameters);
  const Eigen::Quaterniond turned = increment_->rotation * RotationExp(change);
  const Eigen::Map<const Eigen::Quaterniond> first(parts.first), second_in_its_world(parts.second);
  // The second attitude, relative to the world as it was oriented at the first.
  Eigen::Quaterniond second = second_in_its_world;
  Eigen::Vector3d earth_turn = Eigen::Vector3d::Zero();
  if (counts_earth_rate_) {
    earth_turn = EarthTurnOf(parts.reference);
    second = RotationExp(earth_turn) * second_in_its_world;
  }
  const Eigen::Vector3d log = RotationLog(turned.conjugate() * (first.conjugate() * second));
  Eigen::Map<Eigen::Vector3d>{residuals} = log;
  // An asymmetry that the data do not determine may grow beyond 1, and then no rate explains the
  // readings.
  if (!log.allFinite()) return false;
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d from_right = InverseRightJacobian(log);
  // A change d multiplies by Exp(-J_r(change) J d) from the left, and the inverse left Jacobian is
  // the transpose of the inverse right one.
  const Eigen::Matrix3d by_change = -from_right.transpose() * RightJacobian(change);
  TriadBlocks::ByParts by;
  by.bias = by_change * increment_->by_bias;
  by.sensitivity = by_change * increment_->by_sensitivity;
  for (const AxisTermInfo& info : kAxisTerms) {
    if (!at_->is_bent) break;
    by.axis_terms[info.term] = by_change * increment_->by_axis_term[info.term];
  }
  triad_blocks_.SetJacobians(by, jacobians);
  double** jacobian = jacobians + triad_blocks_.count();
  if (has_g_sensitivity_) {
    if (*jacobian != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>>{* jacobian} =
          by_change * increment_->by_g_sensitivity;
    }
    ++jacobian;
  }
  if (counts_earth_rate_) {
    if (*jacobian != nullptr) {
      // Exp(e + d) R = Exp(e) R Exp(R^T J_r(e) d).
      Eigen::Map<Eigen::Matrix<double, 3, kReferenceSize, Eigen::RowMajor>>{* jacobian} =
          from_right * second_in_its_world.toRotationMatrix().transpose() *
          RightJacobian(earth_turn) * increment_->duration_s *
          EarthRateJacobian(earth_rate_radps_, Eigen::Map<const ReferenceVector>(parts.reference));
    }
    ++jacobian;
  }
  if (jacobian[0] != nullptr) {
    // (R Exp(d))^T Q = R^T Q Exp(-Q^T R d).
    Eigen::Map<RowMajor34>{jacobian[0]} = -from_right *
                                          (second.conjugate() * first).toRotationMatrix() *
                                          TangentFromQuaternion(parts.first);
  }
  if (jacobian[1] != nullptr) {
    Eigen::Map<RowMajor34>{jacobian[1]} = from_right * TangentFromQuaternion(parts.second);
  }
  return true;
}

}  // namespace truetriad
