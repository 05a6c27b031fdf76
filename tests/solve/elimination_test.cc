// SPDX-License-Identifier: Apache-2.0
//
// The elimination behind one Ceres cost against what it stands for: the same problem with a block a
// pose and a turn, given to Ceres as it is.
#include <algorithm>
#include <memory>

#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include "noise/variance_components.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/linearised_graph.h"
#include "solve/row_products.h"
#include "solve/shared_blocks.h"
#include "solve/solve_graph.h"
#include "support/accel_mag_trials.h"
#include "support/pose_cost.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

// Nine axes, turns between the poses; everything at the truth, where the noise pulls it away from.
PoseGraph NineAxisGraph(std::uint64_t seed) {
  Random random(seed);
  SyntheticUnit unit = trials::RandomUnit({}, &random);
  unit.models[kGyroscope] = trials::RandomModel({}, 1.0, &random);
  unit.units[kGyroscope] = trials::UnitOf(kGyroscope, false);
  CalibrateOptions options = trials::JointOptions(unit);
  options.triads[kGyroscope].enabled = true;
  SyntheticNoise noise = trials::ModelNoise();
  noise.rest_sigma[kGyroscope] = 5e-5;
  SyntheticTurns turns;
  turns.gyroscope_sigma_radps = 1e-3;
  const auto attitudes = RandomAttitudes(16, &random);
  PoseSet poses = SimulatePoses(unit, attitudes, noise, &random);
  AddTurns(unit, attitudes, turns, &random, &poses);

  StartValues truth;
  truth.models = unit.models;
  truth.reference << unit.gravity_mps2, unit.field_ut, unit.dip_rad, 0.0;
  PerTriad<NoiseSource> sources;
  sources.items.fill(NoiseSource::kStatic);
  PoseGraph graph;
  graph.nodes = *BuildNodes(poses, options, sources);
  LayOutParameters(options, truth, &graph);
  BuildIncrements(poses, truth, &graph);
  ApplyExcess(ExcessVariance{}, &graph);
  return graph;
}

// With the increments as they are integrated.
double SolveBlockByBlock(PoseGraph* graph) {
  ceres::Problem problem;
  const auto add_blocks = [&](const std::vector<SharedBlock>& blocks) {
    std::vector<double*> values;
    for (const SharedBlock& block : blocks) {
      values.push_back(graph->shared.data() + block.offset);
    }
    return values;
  };
  for (const SharedBlock& block : SharedBlocks(graph->layout)) {
    double* values = graph->shared.data() + block.offset;
    problem.AddParameterBlock(values, block.size);
    const Eigen::MatrixXd basis = graph->layout.BlockBasis(block.offset, block.size);
    if (basis.cols() == 0) {
      problem.SetParameterBlockConstant(values);
    } else {
      problem.SetManifold(values, new LinearManifold(basis));
    }
  }
  for (PoseNode& node : graph->nodes) {
    problem.AddParameterBlock(
        node.state.data(), node.state_size(), new ceres::EigenQuaternionManifold);
    std::vector<double*> blocks = add_blocks(SharedBlocks(graph->layout));
    blocks.push_back(node.state.data());
    problem.AddResidualBlock(new PoseCost(graph->layout, node), nullptr, blocks);
  }
  for (const IncrementEdge& edge : graph->increments) {
    std::vector<double*> blocks = add_blocks(GyroscopeBlocks(graph->layout));
    blocks.push_back(graph->nodes[edge.from].state.data());
    blocks.push_back(graph->nodes[edge.from + 1].state.data());
    problem.AddResidualBlock(new IncrementCost(graph->layout, edge), nullptr, blocks);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.function_tolerance = 1e-15;
  options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

TEST(Elimination, EndsWhereCeresEndsBlockByBlock) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    PoseGraph eliminated = NineAxisGraph(seed);
    const SolveOutcome outcome = SolveGraph(&eliminated);
    EXPECT_TRUE(outcome.converged);
    // From the truth again, the turns integrated where the other has ended.
    PoseGraph whole = NineAxisGraph(seed);
    whole.increments = eliminated.increments;
    const double cost = SolveBlockByBlock(&whole);
    EXPECT_NEAR(cost, outcome.final_cost, 1e-9 * cost);
    // χ² by which the two differ: the square root of what the cost is known to, in σ.
    const LinearisedGraph system(eliminated);
    const Eigen::VectorXd off =
        eliminated.layout.basis.transpose() * (whole.shared - eliminated.shared);
    EXPECT_LT(off.dot(system.matrix() * off), 1e-8);
  }
}

TEST(Elimination, HasTheCostAndTheStepOfTheWholeProblem) {
  PoseGraph graph = NineAxisGraph(4);
  // The poses first: what they gain is not promised.
  const LinearisedGraph at_truth(graph);
  at_truth.TakeStep(Eigen::VectorXd::Zero(at_truth.size()), &graph);
  const LinearisedGraph system(graph);
  const Eigen::VectorXd step = -system.matrix().ldlt().solve(system.gradient());
  PoseGraph moved = graph;
  system.TakeStep(step, &moved);
  const LinearisedGraph after(moved);
  // At the optimum of the linear problem nothing is left to go but what is not linear.
  const double promised = -system.gradient().dot(step);
  const Eigen::VectorXd next = -after.matrix().ldlt().solve(after.gradient());
  EXPECT_LT(-after.gradient().dot(next), 1e-2 * promised);
  EXPECT_NEAR(system.cost() - after.cost(), 0.5 * promised, 1e-2 * promised);
}

TEST(RowProducts, AreProducts) {
  Random random(3);
  const auto draw = [&](Eigen::Index rows, Eigen::Index cols) {
    StackedRows drawn(rows, cols);
    for (double& value : drawn.reshaped()) value = random.Normal();
    return drawn;
  };
  // Sizes on both sides of a block's and of its multiples.
  for (const Eigen::Index cols : {1, 3, 4, 7, 8, 9, 16, 35}) {
    for (const Eigen::Index rows : {1, 2, 3, 5, 6, 24}) {
      const StackedRows a = draw(rows, cols), b = draw(rows, cols);
      const double rounding = 1e-13 * static_cast<double>(rows + cols);
      const Eigen::MatrixXd plain = a.transpose() * b;
      EXPECT_LT((TransposedProduct(a, b) - plain).cwiseAbs().maxCoeff(), rounding);
      const Eigen::MatrixXd square = a.transpose() * a;
      EXPECT_LT((SymmetricProduct(a, a) - square).cwiseAbs().maxCoeff(), rounding);
      const StackedRows right = draw(std::max<Eigen::Index>(cols - 1, 1), cols);
      const Eigen::MatrixXd of_rows = a.leftCols(right.rows()) * right;
      EXPECT_LT((ProductOfRows(a, right) - of_rows).cwiseAbs().maxCoeff(), rounding);
      if (rows > 12) continue;
      const StackedRows small = draw(5, rows);
      StackedRows out = draw(5, cols);
      const Eigen::MatrixXd sum = out - small * b;
      AddProduct(-1.0, small, b, out);
      EXPECT_LT((out - sum).cwiseAbs().maxCoeff(), rounding);
    }
  }
}

}  // namespace
}  // namespace truetriad
