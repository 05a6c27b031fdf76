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

// Per-pose residuals, their RMS before and after, coverage of directions.
void FillPoseQuality(const PoseGraph& graph,
                     const PresentedSolution& solution,
                     const std::vector<DeletionTest>& tests,
                     const TurnErrors& turns,
                     const PoseSet& poses,
                     Quality* quality);

// Prediction error of poses that the fit did not see: folds of every n-th pose, each left out by a
// step of Gauss and Newton from the solution, with weights and excess held; and of turns, one by
// one. `system`: the graph at its solution. Unset when a fold would not be determined.
std::optional<HeldOut> CrossValidate(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const TurnErrors& turns,
                                     int folds);

// What is left out together.
struct HeldOutGroup {
  std::vector<std::size_t> nodes, increments;
};

// Every n-th pose, then every n-th turn, of n folds. Empty when there are too few.
std::vector<HeldOutGroup> GroupsOfPosesAndTurns(const PoseGraph& graph, int folds);

// RMS of held-out residuals in units of their noise: each group left out in turn and compared with
// where the rest of the graph puts it; weights and noise held. A pose that no turn ties to others
// is put where it fits best, so that the parameters alone are tested. Unset without groups, or when
// a rest would not be determined.
std::optional<double> HeldOutError(const PoseGraph& graph, const std::vector<HeldOutGroup>& groups);

}  // namespace truetriad
