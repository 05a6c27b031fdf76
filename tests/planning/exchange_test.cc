// SPDX-License-Identifier: Apache-2.0
#include "planning/exchange.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "math/random.h"
#include "model/attitude_sets.h"
#include "planning/pose_order.h"

namespace truetriad {
namespace exchange_test {

std::vector<InformationRows> RandomRows(int count, int rows, int size, Random* random) {
  std::vector<InformationRows> all;
  for (int k = 0; k < count; ++k) {
    InformationRows one(rows, size);
    for (double& entry : one.reshaped()) entry = random->Normal();
    all.push_back(one);
  }
  return all;
}

TEST(Vacancy, GainIsTheDifferenceOfTheCosts) {
  Random random(1);
  const std::vector<InformationRows> rows = RandomRows(5, 3, 6, &random);
  const Candidates candidates(rows);
  const Eigen::MatrixXd base = Eigen::MatrixXd::Identity(6, 6);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(6, 6);
  for (const Eigen::MatrixXd& weights : {Eigen::MatrixXd(), A}) {
    const Vacancy vacancy(base, weights);
    for (std::size_t c = 0; c < rows.size(); ++c) {
      const double with = DesignCost(DesignInformation(base, candidates, {c}), weights);
      // Rounding of numbers of order ten.
      EXPECT_NEAR(vacancy.Gain(rows[c]), DesignCost(base, weights) - with, 1e-12);
    }
  }
}

TEST(ExchangeUntilSettled, FindsTheBestOfAllSmallDesigns) {
  Random random(2);
  constexpr std::size_t kCandidates = 12;
  const Candidates candidates(RandomRows(kCandidates, 1, 3, &random));
  const Eigen::MatrixXd base = 1e-3 * Eigen::MatrixXd::Identity(3, 3);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < kCandidates; ++a) {
    for (std::size_t b = a; b < kCandidates; ++b) {
      for (std::size_t c = b; c < kCandidates; ++c) {
        least = std::min(least, DesignCost(DesignInformation(base, candidates, {a, b, c}), {}));
      }
    }
  }
  Design design = GreedyDesign(base, candidates, {}, 3);
  ExchangeUntilSettled(base, candidates, {}, &design);
  EXPECT_NEAR(DesignCost(DesignInformation(base, candidates, design), {}), least, 1e-9);
}

TEST(OrderForOperator, NeedsLessTurningThanTheOrderOfTheGrid) {
  std::vector<ProgramPose> poses;
  for (const Eigen::Quaterniond& q : CubeAttitudes()) poses.push_back({q, {}, ""});
  std::vector<ProgramPose> shuffled = poses;
  Random random(3);
  for (std::size_t k = shuffled.size() - 1; k > 0; --k) {
    std::swap(shuffled[k], shuffled[static_cast<std::size_t>(random.Below(static_cast<int>(k)))]);
  }
  const std::vector<ProgramPose> ordered = OrderForOperator(shuffled, true);
  ASSERT_EQ(ordered.size(), poses.size());
  double turn = 0.0;
  for (std::size_t k = 1; k < ordered.size(); ++k) {
    turn += ordered[k - 1].world_from_body.angularDistance(ordered[k].world_from_body);
  }
  // No two of the 24 are nearer than a quarter turn; the shortest path has nothing else, and what
  // is found is allowed a tenth more.
  EXPECT_LT(turn, 1.1 * 23.0 * 0.5 * 3.14159265358979);
}

TEST(OrderForOperator, KeepsEachChamberTemperatureTogether) {
  std::vector<ProgramPose> poses;
  for (int k = 0; k < 12; ++k) {
    poses.push_back({CubeAttitudes()[static_cast<std::size_t>(k)], 10.0 * (k % 3), ""});
  }
  const std::vector<ProgramPose> ordered = OrderForOperator(poses, true);
  EXPECT_TRUE(std::is_sorted(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) {
    return a.temperature_degc < b.temperature_degc;
  }));
}

}  // namespace exchange_test
}  // namespace truetriad
