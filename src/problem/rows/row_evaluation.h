// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "problem/rows/row.h"

namespace truetriad {

// The values of one row and its derivatives, in a buffer that is reused for the next row.
class RowEvaluation {
 public:
  using Jacobian = Eigen::Map<
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 3, 9>>;

  // `shared`: the vector of all shared parameters; `states`: the states of the row. Returns false
  // if the row cannot be evaluated.
  bool Evaluate(const Row& row,
                const double* shared,
                const std::array<const double*, 2>& states,
                bool with_jacobians);

  Eigen::Map<const Eigen::VectorXd> residual() const { return {residual_.data(), rows_}; }
  // Derivatives by the i-th block of row.shared_blocks(), or by the first or second state (by all
  // of the state's numbers, not along its manifold).
  Jacobian BySharedBlock(std::size_t i) const { return {jacobians_[i], rows_, sizes_[i]}; }
  Jacobian ByState(std::size_t i) const { return BySharedBlock(shared_count_ + i); }
  // All derivatives, block after block, each block row-major.
  const double* jacobians() const { return buffer_.data(); }

 private:
  int rows_ = 0;
  std::size_t shared_count_ = 0;
  std::array<double, 3> residual_{};
  const int* sizes_ = nullptr;
  std::vector<const double*> parameters_;
  std::vector<double*> jacobians_;
  std::vector<double> buffer_;
};

}  // namespace truetriad
