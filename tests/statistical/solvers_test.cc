// SPDX-License-Identifier: Apache-2.0
//
// The two solvers over every working regime: the same optimum and the same covariance. Of a chain
// of motion: tests/motion.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "statistical/regimes.h"

namespace truetriad {
namespace solvers_test {

// Parameters in σ, and σ against σ.
void ExpectSame(const CalibrationSummary& eliminated, const CalibrationSummary& by_ceres) {
  ASSERT_TRUE(eliminated.calibration.IsUsable());
  ASSERT_TRUE(by_ceres.calibration.IsUsable());
  EXPECT_NEAR(by_ceres.final_cost, eliminated.final_cost, 1e-9 * eliminated.final_cost);
  const NamedCovariance& a = eliminated.calibration.covariance;
  const NamedCovariance& b = by_ceres.calibration.covariance;
  ASSERT_EQ(a.parameters, b.parameters);
  const Eigen::VectorXd sigma = a.matrix.diagonal().cwiseSqrt();
  for (const Triad triad : kTriads) {
    const auto& of_a = eliminated.calibration.sensors[triad];
    const auto& of_b = by_ceres.calibration.sensors[triad];
    if (!of_a) continue;
    const Eigen::Array3d bias =
        (of_a->model.bias - of_b->model.bias).array().abs() / of_a->bias_sigma.array().max(1e-300);
    const Eigen::Array33d sensitivity =
        (of_a->model.sensitivity - of_b->model.sensitivity).array().abs();
    for (int axis = 0; axis < 3; ++axis) {
      if (of_a->bias_sigma[axis] > 0.0) {
        EXPECT_LT(bias[axis], 1e-6);
      }
    }
    EXPECT_TRUE((sensitivity <= 1e-6 * of_a->sensitivity_sigma.array() + 1e-15).all());
  }
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    for (Eigen::Index j = 0; j < sigma.size(); ++j) {
      EXPECT_NEAR(a.matrix(i, j), b.matrix(i, j), 1e-6 * sigma[i] * sigma[j] + 1e-300);
    }
  }
}

class Solvers : public ::testing::TestWithParam<trials::Regime> {};

TEST_P(Solvers, EndAtTheSameOptimum) {
  Random random(77);
  const trials::Trial trial = trials::MakeTrial(GetParam(), &random);
  const PoseSet poses = trials::NoisyPoses(trial, &random);
  const auto eliminated = Calibrate(poses, trial.options);
  ASSERT_TRUE(eliminated) << eliminated.error().message;
  CalibrateOptions options = trial.options;
  options.solver = Solver::kCeres;
  const auto by_ceres = Calibrate(poses, options);
  ASSERT_TRUE(by_ceres) << by_ceres.error().message;
  ExpectSame(*eliminated, *by_ceres);
}

INSTANTIATE_TEST_SUITE_P(EveryRegime,
                         Solvers,
                         ::testing::ValuesIn(trials::Regimes()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace solvers_test
}  // namespace truetriad
