// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/chain_problem.h"
#include "solve/outcome.h"

namespace truetriad {

// Minimises the whitened sum of squares over `shared` and the states of `problem`. On return, both
// have the values of the last linearisation.
SolveOutcome SolveChain(Solver solver,
                        double tolerance,
                        int max_iterations,
                        ChainProblem* problem,
                        Eigen::VectorXd* shared);

// Minimises the whitened sum of squares with the graph's solver. Turns are integrated again until
// the optimum does not change.
SolveOutcome SolveGraph(PoseGraph* graph, double tolerance = kFinalTolerance);

}  // namespace truetriad
