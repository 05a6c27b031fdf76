// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <Eigen/Core>
#include <ceres/cost_function.h>

#include "problem/rows/row.h"

namespace truetriad {

// The W for which W^T W is the inverse covariance of a row's values; square, with a row per value.
using RowRoot = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

// A row multiplied by W, so that its values have unit variance, for a ceres::Problem.
class WhitenedRow final : public ceres::CostFunction {
 public:
  WhitenedRow(std::shared_ptr<const Row> row, const RowRoot& root);
  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;
  const Row& row() const { return *row_; }

 private:
  std::shared_ptr<const Row> row_;
  RowRoot root_;
};

}  // namespace truetriad
