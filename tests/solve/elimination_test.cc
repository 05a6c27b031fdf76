// SPDX-License-Identifier: Apache-2.0
//
// The elimination behind one Ceres cost against what it stands for: the same rows given to Ceres as
// they are.
#include <algorithm>
#include <memory>

#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <gtest/gtest.h>

#include "math/dense/cholesky.h"
#include "noise/deletion.h"
#include "noise/variance_components.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/ceres_problem.h"
#include "solve/chain_elimination.h"
#include "solve/linear_manifold.h"
#include "solve/linearised_graph.h"
#include "solve/reduced_system.h"
#include "solve/row_products.h"
#include "solve/solve_graph.h"
#include "support/accel_mag_trials.h"

namespace truetriad {
namespace elimination_test {

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

// Covariance of the free shared coordinates from the whole problem's Jacobian, nothing eliminated.
Eigen::MatrixXd CovarianceOf(const SharedLayout& layout, ceres::Problem* problem) {
  ceres::CRSMatrix sparse;
  EXPECT_TRUE(problem->Evaluate({}, nullptr, nullptr, nullptr, &sparse));
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int row = 0; row < sparse.num_rows; ++row) {
    for (int at = sparse.rows[static_cast<std::size_t>(row)];
         at < sparse.rows[static_cast<std::size_t>(row) + 1];
         ++at) {
      jacobian(row, sparse.cols[static_cast<std::size_t>(at)]) =
          sparse.values[static_cast<std::size_t>(at)];
    }
  }
  // The shared blocks were added first; each has its own columns of the basis.
  const Eigen::MatrixXd inverse = Cholesky(jacobian.transpose() * jacobian).Inverse();
  return inverse.topLeftCorner(layout.free_size(), layout.free_size());
}

TEST(Elimination, EndsWhereCeresEndsRowByRow) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    PoseGraph eliminated = NineAxisGraph(seed);
    const SolveOutcome outcome = SolveGraph(&eliminated);
    EXPECT_TRUE(outcome.converged);
    PoseGraph whole = NineAxisGraph(seed);
    whole.solver = Solver::kCeres;
    const SolveOutcome by_ceres = SolveGraph(&whole);
    EXPECT_TRUE(by_ceres.converged);
    EXPECT_NEAR(by_ceres.final_cost, outcome.final_cost, 1e-9 * outcome.final_cost);
    const ReducedSystem system(eliminated);
    const Eigen::VectorXd off =
        eliminated.layout.basis.transpose() * (whole.shared - eliminated.shared);
    const Eigen::VectorXd sigma = system.covariance().diagonal().cwiseSqrt();
    EXPECT_LT(off.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-6);

    ChainProblem chain = ChainOf(eliminated);
    Eigen::VectorXd shared = eliminated.shared;
    const auto problem = CeresProblemOf(&chain, &shared);
    const Eigen::MatrixXd covariance = CovarianceOf(eliminated.layout, problem.get());
    const Eigen::MatrixXd difference = sigma.cwiseInverse().asDiagonal() *
                                       (covariance - system.covariance()) *
                                       sigma.cwiseInverse().asDiagonal();
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-6);
  }
}

// A reading that is not believed still holds the turn of its pose about the magnetic field. Where
// it is longer than twice gravity's part across that field, Gauss-Newton steps over the least cost
// further and further.
TEST(Elimination, ReachesTheLeastCostBesideALongReadingThatIsNotBelieved) {
  for (const double times : {2.0, 3.0, 10.0}) {
    for (std::size_t at = 0; at < 16; ++at) {
      PoseGraph graph = NineAxisGraph(7);
      graph.increments.clear();
      Observation& reading = graph.nodes[at].observations.front();
      ASSERT_EQ(reading.triad, Triad::kAccelerometer);
      reading.mean_raw =
          times *
          Eigen::Vector3d(reading.mean_raw.y(), -reading.mean_raw.z(), reading.mean_raw.x());
      reading.weight = kRejectedWeight;
      PoseGraph whole = graph;
      whole.solver = Solver::kCeres;
      const SolveOutcome outcome = SolveGraph(&graph);
      EXPECT_TRUE(outcome.converged) << times << " times at pose " << at;
      const double least = SolveGraph(&whole).final_cost;
      EXPECT_NEAR(outcome.final_cost, least, 1e-9 * least) << times << " times at pose " << at;
    }
  }
}

// What is left of the problem by the elimination that solves it and by the one that keeps its rows.
TEST(Elimination, HasTheCostAndTheStepOfTheWholeProblem) {
  PoseGraph graph = NineAxisGraph(4);
  // The poses first: what they gain is not promised.
  const LinearisedGraph at_truth(graph);
  at_truth.TakeStep(Eigen::VectorXd::Zero(at_truth.size()), &graph);
  ChainElimination elimination(ChainOf(graph));
  elimination.Linearise(graph.shared);
  const LinearisedGraph system(graph);
  const double size = system.matrix().norm();
  EXPECT_LT((elimination.information() - system.matrix()).norm(), 1e-11 * size);
  EXPECT_LT((elimination.gradient() - system.gradient()).norm(), 1e-9 * system.gradient().norm());
  EXPECT_NEAR(elimination.cost(), system.cost(), 1e-12 * system.cost());
  EXPECT_NEAR(elimination.CostAt(graph.shared), system.cost(), 1e-2 * system.cost());

  const Eigen::VectorXd step = -PivotedCholesky(system.matrix()).SolveVector(system.gradient());
  PoseGraph moved = graph;
  system.TakeStep(step, &moved);
  const LinearisedGraph after(moved);
  elimination.Linearise(moved.shared);
  EXPECT_NEAR(elimination.cost(), after.cost(), 1e-11 * after.cost());
  // At the optimum of the linear problem nothing is left to go but what is not linear.
  const double promised = -system.gradient().dot(step);
  const Eigen::VectorXd next = -PivotedCholesky(after.matrix()).SolveVector(after.gradient());
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

TEST(LinearManifold, PlusAndMinusUndoEachOther) {
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(4, 2);
  basis(0, 0) = 1.0;
  basis(2, 1) = basis(3, 1) = std::sqrt(0.5);
  const LinearManifold manifold(basis);
  const Eigen::Vector4d x(1.0, 2.0, 3.0, 4.0);
  const Eigen::Vector2d delta(0.5, -0.25);
  Eigen::Vector4d y;
  Eigen::Vector2d back;
  ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
  ASSERT_TRUE(manifold.Minus(y.data(), x.data(), back.data()));
  EXPECT_LT((back - delta).norm(), 1e-15);
  EXPECT_EQ(y[1], 2.0);               // held
  EXPECT_EQ(y[3] - 4.0, y[2] - 3.0);  // tied
}

}  // namespace elimination_test
}  // namespace truetriad
