// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/known_speed_row.h"

#include "problem/rows/attitude.h"

namespace truetriad {

KnownSpeedRow::KnownSpeedRow(const SharedLayout& layout,
                             const ThermalFactors& factors,
                             double speed_radps,
                             const Eigen::Vector3d& force_mps2,
                             const Eigen::Vector3d& mean_raw)
    : Row(3),
      speed_radps_(speed_radps),
      force_mps2_(force_mps2),
      mean_raw_(mean_raw),
      has_g_sensitivity_(layout.g_sensitivity >= 0),
      triad_blocks_(layout, Triad::kGyroscope, factors) {
  for (const SharedBlock& block : triad_blocks_.blocks()) AddShared(block);
  if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
  AddState(kDirectionSize);
}

bool KnownSpeedRow::Evaluate(double const* const* parameters,
                             double* residuals,
                             double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  std::size_t at = triad_blocks_.count();
  const TriadModel<double> model = triad_blocks_.ModelAt(parameters);
  double* by_g_sensitivity = has_g_sensitivity_ ? jacobians[at++] : nullptr;
  const Eigen::Map<const Eigen::Vector3d> axis(parameters[at]);
  const Eigen::Vector3d rate = speed_radps_ * axis;
  triad_blocks_.SetFieldJacobians(model, rate, jacobians);
  if (by_g_sensitivity != nullptr) SetMatrixTimesVector(force_mps2_, by_g_sensitivity);
  if (double* by_axis = jacobians[at]; by_axis != nullptr) {
    const Eigen::Vector3d slope = model.Slope(model.sensitivity * rate);
    // Along the sphere; what is across it does not count.
    Eigen::Map<RowMajor33>{by_axis} = speed_radps_ * slope.asDiagonal() * model.sensitivity *
                                      (Eigen::Matrix3d::Identity() - axis * axis.transpose());
  }
  return true;
}

}  // namespace truetriad
