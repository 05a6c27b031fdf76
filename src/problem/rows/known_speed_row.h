// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/parameters.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"

namespace truetriad {

// The gyroscope while a rate of known size w was held about an axis d that nobody knows, as on a
// turntable that the unit is fixed to in any attitude:
//
//   rows   h(S w d) + b + G f - y        raw unit of the gyroscope
//
// With d at its best this is |C (y - b - G f)| = w, each weighed with its own noise. f: mean
// specific force meanwhile, as the accelerometer saw it. Parameters: the triad's (TriadBlocks);
// g-sensitivity (9, column by column), where there is one; the axis, a direction in the body. The
// rate is stated against the table: the earth's is not counted in it.
class KnownSpeedRow final : public Row {
 public:
  KnownSpeedRow(const SharedLayout& layout,
                const ThermalFactors& factors,
                double speed_radps,
                const Eigen::Vector3d& force_mps2,
                const Eigen::Vector3d& mean_raw);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    std::size_t at = triad_blocks_.count();
    Vector3 pull = Vector3::Zero();
    if (has_g_sensitivity_) {
      pull = Eigen::Map<const Eigen::Matrix<T, 3, 3>>(parameters[at++]) *
             Vector3(force_mps2_.cast<T>());
    }
    const Vector3 rate = T(speed_radps_) * Eigen::Map<const Vector3>(parameters[at]);
    Eigen::Map<Vector3>{residuals} = model.RawFromTruth(rate) + pull - mean_raw_.cast<T>();
    return true;
  }

 private:
  double speed_radps_ = 0.0;
  Eigen::Vector3d force_mps2_, mean_raw_;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
