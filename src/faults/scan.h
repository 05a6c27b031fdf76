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

// What a fault's columns are multiplied with: stretches x functions. The mean over the poses is
// taken off, so that what varies does not pass for its mean.
using StretchWeights = Eigen::MatrixXd;

// Positions that a shape is looked for at, as stretches from `first` to before `second`. A step
// leaves two poses on each side; a window is at most half the run.
// `columns`: of the form; where they are empty nothing is seen, and there are none.
std::vector<std::pair<int, int>> PositionsOf(FaultShape shape,
                                             const FaultScene& scene,
                                             const std::vector<FaultColumn>& columns);

// Empty where the scene has nothing of the kind: no temperature, too few poses to wander.
StretchWeights WeightsOf(FaultShape shape, std::pair<int, int> position, const FaultScene& scene);

// The columns of a form in every stretch, with all that tests need of them. With Z_g of stretch g
// and suffix sums, everything about Σ w_g Z_g is a sum over the places where w changes: a step has
// two of them, a window three.
class ScannedForm {
 public:
  // `is_whole`: no weights but ones will be asked for.
  ScannedForm(std::vector<FaultColumn> stretches, bool is_whole);

  // Beside what is in a system now.
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
