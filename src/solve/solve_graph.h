// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"

namespace truetriad {

// How an optimisation ended.
struct SolveOutcome {
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

// Minimises the whitened sum of squares with Ceres, the poses eliminated: the cost of a step is
// linear in their number, those that turns hang together in chains included. Turns are integrated
// again until the optimum stays.
// It stops when a step lowers the cost by less than `tolerance` of it: a cost of χ² size then
// stands within sqrt(tolerance * χ²) σ of the optimum.
inline constexpr double kFinalTolerance = 1e-13;
inline constexpr double kRoundTolerance = 1e-8;  // between rounds of weights and noise
SolveOutcome SolveGraph(PoseGraph* graph, double tolerance = kFinalTolerance);

}  // namespace truetriad
