// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "problem/rows/row.h"

namespace truetriad {

// A row with what it might follow beside the model, for score tests: unknowns h that are zero.
//
//   rows   r + D h
//
// Parameters: the row's own shared blocks, those of the probes, the row's states.
class ProbedRow final : public Row {
 public:
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 9>;
  struct Probe {
    SharedBlock block;
    // D, one column for each unknown; or, where it is empty, `factor` times the row's derivative by
    // its own shared block at offset `like`.
    Columns by;
    int like = -1;
    double factor = 0.0;
  };
  ProbedRow(std::shared_ptr<const Row> row, std::vector<Probe> probes);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

 private:
  std::size_t PlaceOf(int offset) const;

  std::shared_ptr<const Row> row_;
  std::vector<Probe> probes_;
};

}  // namespace truetriad
