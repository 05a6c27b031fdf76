// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/whitened_row.h"

namespace truetriad {

WhitenedRow::WhitenedRow(std::shared_ptr<const Row> row, const RowRoot& root)
    : row_(std::move(row)), root_(root) {
  set_num_residuals(row_->num_residuals());
  *mutable_parameter_block_sizes() = row_->parameter_block_sizes();
}

bool WhitenedRow::Evaluate(double const* const* parameters,
                           double* residuals,
                           double** jacobians) const {
  if (!row_->Evaluate(parameters, residuals, jacobians)) return false;
  const Eigen::Index rows = num_residuals();
  const auto whiten = [&](double* values, Eigen::Index columns) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> block(
        values, rows, columns);
    block = (root_ * block).eval();
  };
  whiten(residuals, 1);
  if (jacobians == nullptr) return true;
  for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i) {
    if (jacobians[i] != nullptr) whiten(jacobians[i], parameter_block_sizes()[i]);
  }
  return true;
}

}  // namespace truetriad
