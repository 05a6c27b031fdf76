// SPDX-License-Identifier: Apache-2.0
#include "noise/bounded_step.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace truetriad {
namespace bounded_step_test {

// A random problem whose components differ by as much as those of turns and magnetometers do.
struct Problem {
  explicit Problem(std::mt19937* random) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> decades(-4.0, 8.0);
    const Eigen::Index count = 4;
    const Eigen::MatrixXd root =
        Eigen::MatrixXd::NullaryExpr(count, count, [&] { return normal(*random); });
    const Eigen::VectorXd scale =
        Eigen::VectorXd::NullaryExpr(count, [&] { return std::pow(10.0, decades(*random)); });
    const Eigen::MatrixXd core =
        root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(count, count);
    information = scale.asDiagonal() * core * scale.asDiagonal();
    score = Eigen::VectorXd::NullaryExpr(count, [&] { return normal(*random); });
    score.array() *= information.diagonal().array().sqrt();
    limit = Eigen::VectorXd::NullaryExpr(count, [&] { return -std::abs(normal(*random)); });
    limit.array() /= information.diagonal().array().sqrt();
  }
  Eigen::MatrixXd information;
  Eigen::VectorXd score, limit;
};

// Karush, Kuhn and Tucker: nothing is below its limit, what is above has nothing left to gain, what
// stands on it would lose by leaving.
TEST(BoundedStep, IsTheMaximumAboveTheLimits) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    SCOPED_TRACE(trial);
    const Problem problem(&random);
    const Eigen::VectorXd step = StepAbove(problem.limit, problem.information, problem.score);
    const Eigen::VectorXd left = problem.score - problem.information * step;
    for (Eigen::Index s = 0; s < step.size(); ++s) {
      const double sigma = std::sqrt(problem.information(s, s));
      ASSERT_GE(step[s], problem.limit[s]);
      // Rounding of a system whose condition is a thousand after balancing.
      EXPECT_LT(left[s] / sigma, 1e-6);
      if (step[s] > problem.limit[s] * (1.0 - 1e-12)) {
        EXPECT_NEAR(left[s] / sigma, 0.0, 1e-6);
      }
    }
  }
}

}  // namespace bounded_step_test
}  // namespace truetriad
