// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "problem/rows/row.h"

namespace truetriad {

// A prior of one entry of a parameter block, from a data sheet or a batch:
//
//   row   p_i - mean        the parameter's unit
//
// Parameters: the block.
class PriorRow final : public Row {
 public:
  PriorRow(const SharedBlock& block, int index, double mean)
      : Row(1), size_(block.size), index_(index), mean_(mean) {
    AddShared(block);
  }

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override {
    residuals[0] = parameters[0][index_] - mean_;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    std::fill_n(jacobians[0], size_, 0.0);
    jacobians[0][index_] = 1.0;
    return true;
  }

 private:
  int size_, index_;
  double mean_;
};

}  // namespace truetriad
