// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "estimation/graph.h"

namespace truetriad {

// What every optimisation of a graph's shared parameters begins and ends with.
//
// Adds the shared blocks with what is free of each; `graph` keeps their values. Returns them in the
// order of SharedBlocks.
std::vector<double*> AddSharedBlocks(PoseGraph* graph, ceres::Problem* problem);

// Single-threaded and silent; stops when a step lowers the cost by less than `tolerance` of it.
ceres::Solver::Options SolverOptions(double tolerance);

SolveOutcome SolveProblem(ceres::Solver::Options options, ceres::Problem* problem);

}  // namespace truetriad
