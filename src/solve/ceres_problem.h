// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <ceres/problem.h>

#include "solve/chain_problem.h"
#include "solve/outcome.h"

namespace truetriad {

// The whole problem as an ordinary ceres::Problem, without elimination. Every row is a whitened
// residual block, each block of shared parameters is restricted to its free subspace, and every
// attitude has its own manifold. Tests compare the elimination with this problem, and extensions
// add rows to it.
//
// The parameters of the result are `shared` and the states of `problem`, which must outlive it.
std::unique_ptr<ceres::Problem> CeresProblemOf(ChainProblem* problem, Eigen::VectorXd* shared);

// Minimises the problem by Ceres' Levenberg-Marquardt with sparse normal equations.
SolveOutcome SolveByCeres(double tolerance,
                          int max_iterations,
                          ChainProblem* problem,
                          Eigen::VectorXd* shared);

}  // namespace truetriad
