// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "estimation/graph.h"
#include "estimation/motion/chain.h"

namespace truetriad {

// Minimises the chain's cost over the shared parameters and all attitudes. Ceres sees the shared
// parameters alone, behind one cost whose residuals are a square root of the reduced system,
//
//   J^T J = information,  J^T r = gradient,  |r|^2 / 2 = cost
//
// and whose attitudes follow each step as they were eliminated. `graph` holds the shared
// parameters. On return the chain is linearised at the optimum or within a step of it that changes
// nothing any more. `tolerance`: of the cost, relative.
SolveOutcome SolveMotion(MotionChain* chain, PoseGraph* graph, double tolerance);

}  // namespace truetriad
