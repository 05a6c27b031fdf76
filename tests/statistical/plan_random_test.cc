// SPDX-License-Identifier: Apache-2.0
//
// What planning is worth: σ of the planned program against σ of poses taken at random, and against
// the planned poses set down inexactly. Ratios are geometric means over all quantities.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "statistical/joint_plan.h"
#include "support/nightly.h"

namespace truetriad {
namespace plan_random_test {

// Of many draws.
struct Spread {
  double low = 0.0, median = 0.0, high = 0.0;  // quartiles
  double median_error = 0.0;                   // one standard error
};

Spread SpreadOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  Spread spread{at(0.25), at(0.5), at(0.75), 0.0};
  // Of a normal distribution the quartiles are 1.35 σ apart, and the median of n has 1.25 σ / √n.
  spread.median_error =
      1.25 / 1.35 * (spread.high - spread.low) / std::sqrt(static_cast<double>(values.size()));
  return spread;
}

class PlannedTwelve : public ::testing::Test {
 protected:
  // Geometric mean of σ, relative to the planned program's.
  double Ratio(const std::vector<Eigen::Quaterniond>& attitudes) const {
    PlanOptions options = options_;
    options.grid = {};  // judging needs none
    options.program.emplace();
    for (const Eigen::Quaterniond& attitude : attitudes) {
      options.program->poses.push_back({attitude, {}, ""});
    }
    return std::exp(MeanLogSigma(trials::MustPlan(options)) - MeanLogSigma(plan_));
  }

  static double MeanLogSigma(const Plan& plan) {
    double sum = 0.0;
    for (const PlannedSigma& sigma : plan.sigmas) sum += std::log(sigma.after);
    return sum / static_cast<double>(plan.sigmas.size());
  }

  Spread OfRandomPoses(int poses, int draws) const {
    std::vector<double> ratios;
    for (int draw = 0; draw < draws; ++draw) {
      Random random(40000 + static_cast<std::uint64_t>(draw));
      ratios.push_back(Ratio(RandomAttitudes(poses, &random)));
    }
    const Spread spread = SpreadOf(std::move(ratios));
    std::printf("@random | %d | %d | %.2f ± %.3f | %.2f – %.2f |\n",
                poses,
                draws,
                spread.median,
                spread.median_error,
                spread.low,
                spread.high);
    return spread;
  }

  // The planned poses, each turned about a random axis by a normal angle.
  Spread OfPlannedPosesOffBy(double sigma_deg, int draws) const {
    std::vector<double> ratios;
    for (int draw = 0; draw < draws; ++draw) {
      Random random(50000 + static_cast<std::uint64_t>(draw));
      std::vector<Eigen::Quaterniond> attitudes;
      for (const ProgramPose& pose : plan_.program.poses) {
        const double angle = sigma_deg * std::numbers::pi / 180.0 * random.Normal();
        attitudes.push_back(pose.world_from_body *
                            Eigen::AngleAxisd(angle, random.Normal3().normalized()));
      }
      ratios.push_back(Ratio(attitudes));
    }
    const Spread spread = SpreadOf(std::move(ratios));
    std::printf("@inexact | %.0f° | %d | %.3f ± %.3f | %.3f – %.3f |\n",
                sigma_deg,
                draws,
                spread.median,
                spread.median_error,
                spread.low,
                spread.high);
    return spread;
  }

  PlanOptions options_ = trials::JointPlanOptions();
  Plan plan_ = trials::MustPlan(options_);
  int draws_ = IsNightly() ? 1000 : 200;
};

// The claims are about medians; three of their standard errors are granted to chance.
TEST_F(PlannedTwelve, IsHalfAsGoodAgainAsTwelveAtRandom) {
  ASSERT_TRUE(plan_.IsMet());
  ASSERT_EQ(plan_.sigmas.size(), 22U);
  const Spread spread = OfRandomPoses(12, draws_);
  EXPECT_GE(spread.median - 3.0 * spread.median_error, 1.5);
}

TEST_F(PlannedTwelve, IsWorthAboutEighteenAtRandom) {
  for (const int poses :
       IsNightly() ? std::vector{14, 16, 17, 18, 19, 20, 22, 24} : std::vector{17, 20}) {
    const Spread spread = OfRandomPoses(poses, draws_);
    const double margin = 3.0 * spread.median_error;
    if (poses <= 17) {
      EXPECT_GT(spread.median - margin, 1.0) << poses;
    }
    if (poses >= 20) {
      EXPECT_LT(spread.median + margin, 1.0) << poses;
    }
  }
}

// A program is for hands: angles set by eye are good enough.
TEST_F(PlannedTwelve, DoesNotNeedExactAngles) {
  for (const double sigma_deg :
       IsNightly() ? std::vector{2.0, 5.0, 10.0, 20.0} : std::vector{10.0}) {
    const Spread spread = OfPlannedPosesOffBy(sigma_deg, draws_);
    if (sigma_deg <= 10.0) {
      EXPECT_LT(spread.median, 1.1);
    }
  }
}

}  // namespace plan_random_test
}  // namespace truetriad
