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

// The weights with which a fault adds up the columns of the groups: a row for each group of poses,
// a column for each function of time. Except for kThroughout and kOnce, a function's mean over all
// poses is subtracted. The fault is then only a deviation from the mean, which is the calibrated
// parameter.
using StretchWeights = Eigen::MatrixXd;

// The positions at which a shape is tested, each a range of groups from `first` to `second` - 1. A
// step leaves at least two groups on each side; a window has at least two groups and at most half
// of all groups. `columns`: the form's columns, by group. If they are empty, the sensor cannot have
// the form, and there are no positions.
std::vector<std::pair<int, int>> PositionsOf(FaultShape shape,
                                             const FaultScene& scene,
                                             const std::vector<FaultColumn>& columns);

// The weights of `shape` at `position`. Empty if the scene has no data for the shape: no varying
// temperature, or too few poses for kWander.
StretchWeights WeightsOf(FaultShape shape, std::pair<int, int> position, const FaultScene& scene);

// The columns Z_g of a form in each group g of poses, with the sums that tests need. A fault's
// column is Σ w_g Z_g. Each stored sum is over all groups from some g on: the sums for a fault then
// need one term for each group at which w changes, two for a step and three for a window.
class ScannedForm {
 public:
  // `is_whole`: the form is only tested over the whole run, so that all later weights are 1.
  ScannedForm(std::vector<FaultColumn> stretches, bool is_whole);

  // Computes the stored sums. They hold for the columns and variances that `system` has now.
  void Project(const FaultSystem& system);

  ColumnSums SumsOf(const StretchWeights& weights) const;
  FaultColumn Column(const StretchWeights& weights) const;

 private:
  Eigen::Index unknowns() const { return columns_.front().unknowns; }

  std::vector<FaultColumn> columns_;
  bool is_whole_ = false;
  Eigen::MatrixXd suffix_information_;  // blocks (k, l): Σ_{g >= k, h >= l} Z_g^T P Z_h
  Eigen::MatrixXd suffix_gradient_;     // column k: Σ_{g >= k} Z_g^T P r
  Eigen::MatrixXd squares_;
};

}  // namespace truetriad
