// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/rows/rate_row.h"

namespace truetriad {

// The gyroscope while a rate of known size w was held about an unknown axis d, as on a turntable to
// which the unit is fixed in any attitude: rate_row.h at the rate w d.
//
// If d is at its optimum, the rows state |C (y - b - G f)| = w, weighted by the readings' noise.
// Parameters: those of RateRow, and the axis as a direction in the body.
class KnownSpeedRow final : public RateRow {
 public:
  KnownSpeedRow(const SharedLayout& layout,
                const ThermalFactors& factors,
                double speed_radps,
                const Eigen::Vector3d& force_mps2,
                const Eigen::Vector3d& mean_raw)
      : RateRow(layout, factors, force_mps2, mean_raw), speed_radps_(speed_radps) {
    AddState(kDirectionSize);
  }

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Vector3 rate = T(speed_radps_) * Eigen::Map<const Vector3>(parameters[shared_count()]);
    SetResidual<T>(rate, parameters, residuals);
    return true;
  }

 private:
  double speed_radps_ = 0.0;
};

}  // namespace truetriad
