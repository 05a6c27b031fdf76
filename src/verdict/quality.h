// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "noise/deletion.h"
#include "noise/variance_components.h"
#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"
#include "verdict/presentation.h"
#include "verdict/turn_errors.h"

namespace truetriad {

// Running root mean square.
struct RootMeanSquare {
  double sum = 0.0;
  int count = 0;
  void Add(double value) {
    sum += value * value;
    ++count;
  }
  std::optional<double> value() const {
    if (count == 0) return std::nullopt;
    return std::sqrt(sum / count);
  }
};

// States each pose's residuals, their RMS before and after the calibration, and the coverage of
// directions.
void FillPoseQuality(const PoseGraph& graph,
                     const PresentedSolution& solution,
                     const std::vector<DeletionTest>& tests,
                     const TurnErrors& turns,
                     const PoseSet& poses,
                     Quality* quality);

// Prediction error of poses that were not fitted: folds of every n-th pose, each left out by a
// Gauss-Newton step from the solution, with weights and excess held; and of turns, one by one.
// `system`: the graph at its solution. Unset if a fold would be undetermined.
std::optional<HeldOut> CrossValidate(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const TurnErrors& turns,
                                     int folds);

// Poses and turns that are left out together.
struct HeldOutGroup {
  std::vector<std::size_t> nodes, increments;
};

// Every n-th pose, then every n-th turn, for n folds. Empty if there are too few.
std::vector<HeldOutGroup> GroupsOfPosesAndTurns(const PoseGraph& graph, int folds);

// RMS of held-out residuals in units of their noise: each group is left out in turn and compared
// with the prediction by the remaining graph, with weights and noise held. A pose without turns to
// others gets its optimal attitude, so that only the parameters are tested. Unset without groups,
// or if a remaining graph would be undetermined.
std::optional<double> HeldOutError(const PoseGraph& graph, const std::vector<HeldOutGroup>& groups);

}  // namespace truetriad
