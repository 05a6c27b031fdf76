// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/known_rate_row.h"

namespace truetriad {

KnownRateRow::KnownRateRow(const SharedLayout& layout,
                           const ThermalFactors& factors,
                           const Eigen::Vector3d& rate_radps,
                           const Eigen::Vector3d& force_mps2,
                           const Eigen::Vector3d& mean_raw)
    : Row(3),
      rate_radps_(rate_radps),
      force_mps2_(force_mps2),
      mean_raw_(mean_raw),
      has_g_sensitivity_(layout.g_sensitivity >= 0),
      triad_blocks_(layout, Triad::kGyroscope, factors) {
  for (const SharedBlock& block : triad_blocks_.blocks()) AddShared(block);
  if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
}

bool KnownRateRow::Evaluate(double const* const* parameters,
                            double* residuals,
                            double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  const TriadModel<double> model = triad_blocks_.ModelAt(parameters);
  triad_blocks_.SetFieldJacobians(model, rate_radps_, jacobians);
  if (!has_g_sensitivity_) return true;
  if (double* by_g_sensitivity = jacobians[triad_blocks_.count()]; by_g_sensitivity != nullptr) {
    SetMatrixTimesVector(force_mps2_, by_g_sensitivity);
  }
  return true;
}

}  // namespace truetriad
