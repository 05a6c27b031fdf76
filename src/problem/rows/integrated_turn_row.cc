// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/integrated_turn_row.h"

#include "problem/rows/attitude.h"
#include "truetriad/math/rotation.h"

namespace truetriad {

IntegratedTurnRow::IntegratedTurnRow(const SharedLayout& layout, const GyroReadings& readings)
    : Row(3),
      readings_(readings),
      has_g_sensitivity_(layout.g_sensitivity >= 0),
      triad_blocks_(layout, Triad::kGyroscope, ThermalFactors()) {
  AddFirstShared(triad_blocks_.blocks(), 1);
  if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
  AddState(kAttitudeSize);
  AddState(kAttitudeSize);
}

bool IntegratedTurnRow::Evaluate(double const* const* parameters,
                                 double* residuals,
                                 double** jacobians) const {
  std::size_t at = triad_blocks_.count();
  GyroModel model{triad_blocks_.ModelAt(parameters)};
  model.is_bent = triad_blocks_.has_axis_terms();
  if (has_g_sensitivity_) {
    model.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(parameters[at++]);
  }
  const Eigen::Map<const Eigen::Quaterniond> first(parameters[at]), second(parameters[at + 1]);
  const Eigen::Quaterniond between = first.conjugate() * second;
  Eigen::Map<Eigen::Vector3d> log{residuals};
  if (jacobians == nullptr) {
    const Eigen::Quaterniond turned =
        IntegrateRotation(readings_, model, RateSampling::kInstantaneous);
    log = RotationLog(turned.conjugate() * between);
    return log.allFinite();
  }
  const GyroIncrement increment =
      IntegrateMove(readings_, model, Eigen::Vector3d::Zero(), RateSampling::kInstantaneous);
  log = RotationLog(increment.rotation.conjugate() * between);
  if (!log.allFinite()) return false;

  const Eigen::Matrix3d from_right = InverseRightJacobian(log);
  // Exp(-J d) from the left; the inverse left Jacobian is the right one's transpose.
  const Eigen::Matrix3d by_change = -from_right.transpose();
  TriadBlocks::ByParts by;
  by.bias = by_change * increment.by_bias;
  by.sensitivity = by_change * increment.by_sensitivity;
  for (const AxisTermInfo& info : kAxisTerms) {
    if (!model.is_bent) break;
    by.axis_terms[info.term] = by_change * increment.by_axis_term[info.term];
  }
  triad_blocks_.SetJacobians(by, jacobians);
  double** jacobian = jacobians + triad_blocks_.count();
  if (has_g_sensitivity_) {
    if (*jacobian != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>>{* jacobian} =
          by_change * increment.by_g_sensitivity;
    }
    ++jacobian;
  }
  if (jacobian[0] != nullptr) {
    // (R Exp(d))^T Q = R^T Q Exp(-Q^T R d).
    Eigen::Map<RowMajor34>{jacobian[0]} = -from_right * between.toRotationMatrix().transpose() *
                                          TangentFromQuaternion(first.coeffs().data());
  }
  if (jacobian[1] != nullptr) {
    Eigen::Map<RowMajor34>{jacobian[1]} =
        from_right * TangentFromQuaternion(second.coeffs().data());
  }
  return true;
}

}  // namespace truetriad
