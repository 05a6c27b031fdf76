// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "faults/fault_test.h"
#include "faults/kinds.h"
#include "faults/scene.h"

namespace truetriad {

// Factors of a fault's columns: a row for each group of poses, a column for each function of time.
// Except for kThroughout and kOnce, a function's mean over the poses is subtracted, so that the
// parameters state the mean of the value that varies.
using StretchWeights = Eigen::MatrixXd;

// Positions at which a shape is tested: the groups from `first` up to, but without, `second`. A
// step leaves two groups on each side; a window is at most half the run. `columns`: of the form, by
// group; if empty, the sensor cannot have the form, and there are no positions.
std::vector<std::pair<int, int>> PositionsOf(FaultShape shape,
                                             const FaultScene& scene,
                                             const std::vector<FaultColumn>& columns);

// Empty if the scene has no data for the shape: no temperature, or too few poses for kWander.
StretchWeights WeightsOf(FaultShape shape, std::pair<int, int> position, const FaultScene& scene);

// The columns of a form in every group of poses, with the sums that tests need. With suffix sums of
// the columns Z_g of groups g, Σ w_g Z_g needs a term only for each group at which the weight w
// changes: two for a step, three for a window.
class ScannedForm {
 public:
  // `is_whole`: all later weights are ones.
  ScannedForm(std::vector<FaultColumn> stretches, bool is_whole);

  // Computes the sums, with the columns that the system includes at present.
  void Project(const FaultSystem& system);

  ColumnSums SumsOf(const StretchWeights& weights) const;
  FaultColumn Column(const StretchWeights& weights) const;

 private:
  Eigen::Index unknowns() const { return columns_.front().unknowns; }

  std::vector<FaultColumn> columns_;
  bool is_whole_ = false;
  Eigen::MatrixXd suffix_information_;  // blocks (k, l): Σ_{g >= k, h >= l} Z_g^T P Z_h
  Eigen::MatrixXd suffix_gradient_;     // unknowns x stretches
  Eigen::MatrixXd squares_;
};

}  // namespace truetriad
