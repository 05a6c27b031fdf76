// SPDX-License-Identifier: Apache-2.0
#include "solve/ceres_problem.h"

#include <ceres/manifold.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include "problem/graph_rows.h"
#include "solve/linear_manifold.h"

namespace truetriad {
namespace {

void AddShared(const SharedLayout& layout, double* shared, ceres::Problem* problem) {
  for (const SharedBlock& block : SharedBlocks(layout)) {
    double* values = shared + block.offset;
    problem->AddParameterBlock(values, block.size);
    const Eigen::MatrixXd basis = layout.BlockBasis(block.offset, block.size);
    if (basis.cols() == 0) {
      problem->SetParameterBlockConstant(values);
    } else {
      problem->SetManifold(values, new LinearManifold(basis));
    }
  }
}

void AddState(ChainState* state, ceres::Problem* problem) {
  double* values = state->values.data();
  problem->AddParameterBlock(values, AmbientSize(state->kind));
  switch (state->kind) {
    case PoseKind::kHeld:
      problem->SetParameterBlockConstant(values);
      break;
    case PoseKind::kDirection:
      problem->SetManifold(values, new ceres::SphereManifold<3>);
      break;
    case PoseKind::kRotation:
      problem->SetManifold(values, new ceres::EigenQuaternionManifold);
      break;
  }
}

}  // namespace

std::unique_ptr<ceres::Problem> CeresProblemOf(ChainProblem* problem, Eigen::VectorXd* shared) {
  auto ceres_problem = std::make_unique<ceres::Problem>();
  AddShared(*problem->layout, shared->data(), ceres_problem.get());
  for (ChainState& state : problem->states) AddState(&state, ceres_problem.get());
  std::vector<double*> blocks;
  for (const ChainRow& row : problem->rows) {
    blocks.clear();
    for (const SharedBlock& block : row.row->shared_blocks()) {
      blocks.push_back(shared->data() + block.offset);
    }
    for (std::size_t i = 0; i < row.row->state_count(); ++i) {
      blocks.push_back(problem->states[row.state + i].values.data());
    }
    ceres_problem->AddResidualBlock(new WhitenedRow(row.row, row.root), nullptr, blocks);
  }
  return ceres_problem;
}

SolveOutcome SolveByCeres(double tolerance,
                          int max_iterations,
                          ChainProblem* problem,
                          Eigen::VectorXd* shared) {
  const std::unique_ptr<ceres::Problem> ceres_problem = CeresProblemOf(problem, shared);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.max_num_iterations = max_iterations;
  // If a step would lower the cost by less than the tolerance, Ceres does not take it, so that an
  // error of this size remains. The tolerance is therefore smaller than the wanted one.
  options.function_tolerance = 0.01 * tolerance;
  options.parameter_tolerance = 1e-13;
  options.gradient_tolerance = 0.0;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, ceres_problem.get(), &summary);
  SolveOutcome outcome;
  outcome.converged = summary.termination_type == ceres::CONVERGENCE;
  outcome.iterations = static_cast<int>(summary.iterations.size());
  outcome.initial_cost = summary.initial_cost;
  outcome.final_cost = summary.final_cost;
  return outcome;
}

}  // namespace truetriad
