// SPDX-License-Identifier: Apache-2.0
#include "estimation/graph.h"

#include <cmath>
#include <memory>

#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include "estimation/pose_cost.h"
#include "estimation/shared_problem.h"

namespace truetriad {
namespace {

constexpr int kMaxIterations = 200;
constexpr int kMaxIntegrations = 10;
// Of the tolerance: an increment that is linear to this needs no integration.
constexpr double kStillLinear = 1e-2;

// sum over entries of ((x_i - mean_i) / sigma_i)^2 for the priors that fall into one block.
std::unique_ptr<ceres::CostFunction> BlockPrior(const std::vector<ScalarPrior>& priors,
                                                const SharedBlock& block) {
  std::vector<const ScalarPrior*> inside;
  for (const ScalarPrior& prior : priors) {
    if (prior.index >= block.offset && prior.index < block.offset + block.size) {
      inside.push_back(&prior);
    }
  }
  if (inside.empty()) return nullptr;
  ceres::Matrix weights = ceres::Matrix::Zero(static_cast<Eigen::Index>(inside.size()), block.size);
  ceres::Vector means = ceres::Vector::Zero(block.size);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const int at = inside[i]->index - block.offset;
    weights(static_cast<Eigen::Index>(i), at) = 1.0 / inside[i]->sigma;
    means[at] = inside[i]->mean;
  }
  return std::make_unique<ceres::NormalPrior>(weights, means);
}

SolveOutcome SolveLinearised(PoseGraph* graph, double tolerance) {
  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();

  std::vector<double*> gyroscope_blocks;
  for (const SharedBlock& block : GyroscopeBlocks(graph->layout)) {
    gyroscope_blocks.push_back(graph->shared.data() + block.offset);
  }
  const std::vector<double*> shared_blocks = AddSharedBlocks(graph, &problem);
  for (const SharedBlock& block : SharedBlocks(graph->layout)) {
    double* values = graph->shared.data() + block.offset;
    if (auto prior = BlockPrior(graph->priors, block)) {
      problem.AddResidualBlock(prior.release(), nullptr, values);
    }
    ordering->AddElementToGroup(values, 1);
  }
  for (PoseNode& node : graph->nodes) {
    problem.AddParameterBlock(node.state.data(), node.state_size());
    if (node.kind == PoseKind::kHeld) {
      problem.SetParameterBlockConstant(node.state.data());
    } else if (node.kind == PoseKind::kDirection) {
      problem.SetManifold(node.state.data(), new ceres::SphereManifold<3>);
    } else {
      problem.SetManifold(node.state.data(), new ceres::EigenQuaternionManifold);
    }
    ordering->AddElementToGroup(node.state.data(), 0);
    if (node.row_count() == 0) continue;
    std::vector<double*> blocks = shared_blocks;
    blocks.push_back(node.state.data());
    problem.AddResidualBlock(new PoseCost(graph->layout, node), nullptr, blocks);
  }

  for (const IncrementEdge& edge : graph->increments) {
    std::vector<double*> blocks = gyroscope_blocks;
    blocks.push_back(graph->nodes[edge.from].state.data());
    blocks.push_back(graph->nodes[edge.from + 1].state.data());
    problem.AddResidualBlock(new IncrementCost(graph->layout, edge), nullptr, blocks);
  }

  ceres::Solver::Options options = SolverOptions(tolerance);
  if (graph->increments.empty()) {
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = ordering;
  } else {
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  }
  options.max_num_iterations = kMaxIterations;
  options.max_num_consecutive_invalid_steps = 20;
  return SolveProblem(options, &problem);
}

}  // namespace

SolveOutcome SolveGraph(PoseGraph* graph, double tolerance) {
  const auto integrate = [graph] {
    for (IncrementEdge& edge : graph->increments) {
      edge.Integrate(graph->layout, graph->shared.data());
    }
    graph->integrated_at = graph->shared;
  };
  // An increment is linear in the gyroscope's parameters only near the point where it was
  // integrated: integrated again, until the optimum stays.
  SolveOutcome whole;
  for (int round = 0; round < kMaxIntegrations; ++round) {
    if (graph->integrated_at.size() == 0) graph->integrated_at = graph->shared;
    const SolveOutcome outcome = SolveLinearised(graph, tolerance);
    if (round == 0) whole.initial_cost = outcome.initial_cost;
    whole.converged = outcome.converged;
    whole.iterations += outcome.iterations;
    whole.final_cost = outcome.final_cost;
    if (graph->increments.empty()) break;
    const double moved = ((graph->shared - graph->integrated_at).array() /
                          TypicalSizes(graph->layout, graph->shared).array())
                             .abs()
                             .maxCoeff();
    if (!std::isfinite(moved)) break;
    // The error is of second order in what moved. At the end the turns themselves are looked at.
    const bool is_final = tolerance <= kFinalTolerance;
    if (!is_final && moved * moved < kStillLinear * tolerance) break;
    integrate();
    if (moved * moved < tolerance) break;
  }
  return whole;
}

}  // namespace truetriad
