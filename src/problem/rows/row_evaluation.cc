// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/row_evaluation.h"

namespace truetriad {

bool RowEvaluation::Evaluate(const Row& row,
                             const double* shared,
                             const std::array<const double*, 2>& states,
                             bool with_jacobians) {
  rows_ = row.num_residuals();
  shared_count_ = row.shared_blocks().size();
  sizes_ = row.parameter_block_sizes().data();
  const std::size_t count = row.parameter_block_sizes().size();
  parameters_.resize(count);
  for (std::size_t i = 0; i < shared_count_; ++i) {
    parameters_[i] = shared + row.shared_blocks()[i].offset;
  }
  for (std::size_t i = shared_count_; i < count; ++i) parameters_[i] = states[i - shared_count_];
  if (!with_jacobians) return row.Evaluate(parameters_.data(), residual_.data(), nullptr);
  std::size_t needed = 0;
  for (std::size_t i = 0; i < count; ++i) needed += static_cast<std::size_t>(rows_ * sizes_[i]);
  if (buffer_.size() < needed) buffer_.resize(needed);
  jacobians_.resize(count);
  double* at = buffer_.data();
  for (std::size_t i = 0; i < count; ++i) {
    jacobians_[i] = at;
    at += rows_ * sizes_[i];
  }
  return row.Evaluate(parameters_.data(), residual_.data(), jacobians_.data());
}

}  // namespace truetriad
