// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/parameters.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"

namespace truetriad {

// The gyroscope while a known rate w was held, or the mean rate of a known turn, which shows its
// axis:
//
//   rows   h(S w) + b + G f - y        raw unit of the gyroscope
//
// f: mean specific force meanwhile, as the accelerometer saw it. Parameters: the triad's
// (TriadBlocks); g-sensitivity (9, column by column), where there is one. The rate is stated
// against the table: the earth's is not counted in it.
class KnownRateRow final : public Row {
 public:
  KnownRateRow(const SharedLayout& layout,
               const ThermalFactors& factors,
               const Eigen::Vector3d& rate_radps,
               const Eigen::Vector3d& force_mps2,
               const Eigen::Vector3d& mean_raw);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const TriadModel<T> model = triad_blocks_.ModelAt(parameters);
    Vector3 raw = model.RawFromTruth(Vector3(rate_radps_.cast<T>()));
    if (has_g_sensitivity_) {
      raw += Eigen::Map<const Eigen::Matrix<T, 3, 3>>(parameters[triad_blocks_.count()]) *
             Vector3(force_mps2_.cast<T>());
    }
    Eigen::Map<Vector3>{residuals} = raw - mean_raw_.cast<T>();
    return true;
  }

 private:
  Eigen::Vector3d rate_radps_, force_mps2_, mean_raw_;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
