// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "problem/parameters.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"

namespace truetriad {

// The gyroscope while it turns at a rate w, which known_rate_row.h or known_speed_row.h defines:
//
//   rows   h(S w) + b + G f - y        raw unit of the gyroscope
//
// f: mean specific force in that time, from the accelerometer. Parameters: the triad's
// (TriadBlocks); g-sensitivity (9, column by column), if modelled. Rates are stated relative to the
// table: the earth's rate is not added.
class RateRow : public Row {
 protected:
  RateRow(const SharedLayout& layout,
          const ThermalFactors& factors,
          const Eigen::Vector3d& force_mps2,
          const Eigen::Vector3d& mean_raw)
      : Row(3),
        force_mps2_(force_mps2),
        mean_raw_(mean_raw),
        has_g_sensitivity_(layout.g_sensitivity >= 0),
        triad_blocks_(layout, Triad::kGyroscope, factors) {
    AddFirstShared(triad_blocks_.blocks(), 1);
    if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
  }

  const TriadBlocks& triad_blocks() const { return triad_blocks_; }
  // The number of parameter blocks that precede the states.
  std::size_t shared_count() const { return triad_blocks_.count() + (has_g_sensitivity_ ? 1 : 0); }

  template <typename T>
  void SetResidual(const Eigen::Matrix<T, 3, 1>& rate,
                   T const* const* parameters,
                   T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    Vector3 raw = triad_blocks_.ModelAt(parameters).RawFromTruth(rate);
    if (has_g_sensitivity_) {
      raw += Eigen::Map<const Eigen::Matrix<T, 3, 3>>(parameters[triad_blocks_.count()]) *
             Vector3(force_mps2_.cast<T>());
    }
    Eigen::Map<Vector3>{residuals} = raw - mean_raw_.cast<T>();
  }

  // Jacobians with respect to the shared blocks.
  void SetSharedJacobians(const TriadModel<double>& model,
                          const Eigen::Vector3d& rate,
                          double** jacobians) const {
    triad_blocks_.SetFieldJacobians(model, rate, jacobians);
    if (!has_g_sensitivity_) return;
    if (double* by_g_sensitivity = jacobians[triad_blocks_.count()]; by_g_sensitivity != nullptr) {
      SetMatrixTimesVector(force_mps2_, by_g_sensitivity);
    }
  }

 private:
  Eigen::Vector3d force_mps2_, mean_raw_;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
