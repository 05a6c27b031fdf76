// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "motion/chain.h"
#include "problem/graph.h"
#include "solve/solve_graph.h"

namespace truetriad {

// Minimises the chain's cost over the shared parameters, which `graph` holds, and all attitudes,
// those eliminated. On return the chain is linearised at the optimum or within a step of it that
// changes nothing any more. `tolerance`: of the cost, relative.
SolveOutcome SolveMotion(MotionChain* chain, PoseGraph* graph, double tolerance);

}  // namespace truetriad
