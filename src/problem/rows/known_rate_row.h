// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/rows/rate_row.h"

namespace truetriad {

// A RateRow for the gyroscope's mean reading while a known rate was held, or during a known turn,
// whose axis it determines.
class KnownRateRow final : public RateRow {
 public:
  KnownRateRow(const SharedLayout& layout,
               const ThermalFactors& factors,
               const Eigen::Vector3d& rate_radps,
               const Eigen::Vector3d& force_mps2,
               const Eigen::Vector3d& mean_raw)
      : RateRow(layout, factors, force_mps2, mean_raw), rate_radps_(rate_radps) {}

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    SetResidual<T>(rate_radps_.cast<T>(), parameters, residuals);
    return true;
  }

 private:
  Eigen::Vector3d rate_radps_;
};

}  // namespace truetriad
