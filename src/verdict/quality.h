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

// Errors of predicting poses and turns that were not fitted. Poses are left out in n groups of
// every n-th one, n = `folds`: a Gauss-Newton step from the solution, with weights and excess held,
// gives the parameters without a group. Turns are left out one by one. `system`: that of `graph` at
// its solution. Unset without a vector sensor, with too few poses, or if the remaining poses do not
// determine the parameters.
std::optional<HeldOut> CrossValidate(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const TurnErrors& turns,
                                     int folds);

// Poses and turns that are left out together.
struct HeldOutGroup {
  std::vector<std::size_t> nodes, increments;
};

// Groups of every n-th pose, n = `folds`; after them, if there are enough turns, groups of every
// n-th turn. Empty if there are too few poses.
std::vector<HeldOutGroup> GroupsOfPosesAndTurns(const PoseGraph& graph, int folds);

// RMS of held-out residuals in units of their noise. One group at a time is left out and compared
// with its prediction by the remaining graph, with weights and noise held. A pose that no turn
// links to others gets its optimal attitude, so that only the parameters are tested. Unset without
// groups, or if a remaining graph does not determine the parameters.
std::optional<double> HeldOutError(const PoseGraph& graph, const std::vector<HeldOutGroup>& groups);

}  // namespace truetriad
