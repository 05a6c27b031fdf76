// SPDX-License-Identifier: Apache-2.0
#include "support/kolmogorov_smirnov.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace kolmogorov_smirnov_test {

TEST(KolmogorovSmirnov, AgreesWithPublishedCriticalValues) {
  // Critical values 1.22385, 1.35810, 1.62762 of sqrt(n) D at 10, 5 and 1 % (Smirnov 1948); one
  // value in the midst of n equally spaced ones moves D to what is wanted.
  for (const auto& [critical, tail] :
       {std::pair{1.22385, 0.10}, std::pair{1.35810, 0.05}, std::pair{1.62762, 0.01}}) {
    constexpr int kCount = 1000;
    const double root = std::sqrt(1.0 * kCount);
    const double statistic = critical / (root + 0.12 + 0.11 / root);
    std::vector<double> values;
    for (int i = 0; i < kCount; ++i) {
      values.push_back(std::max(0.0, (i + 1.0) / kCount - statistic));
    }
    const KolmogorovSmirnov test = KolmogorovSmirnovUniform(values);
    EXPECT_NEAR(test.statistic, statistic, 1e-12);
    EXPECT_NEAR(test.p_value, tail, 5e-6 * 0.5);  // half a last digit times the slope, at most 0.5
  }
}

TEST(KolmogorovSmirnov, StatisticIsTheLargestStepDistance) {
  // Steps 0-1/2 at 0.1 and 1/2-1 at 0.7: distances 0.1, 0.4 and 0.2, 0.3.
  EXPECT_NEAR(KolmogorovSmirnovUniform({0.7, 0.1}).statistic, 0.4, 1e-15);
  EXPECT_EQ(KolmogorovSmirnovUniform({0.5}).statistic, 0.5);
  EXPECT_NEAR(KolmogorovSmirnovUniform({2.0, 3.0, -1.0}).statistic, 2.0 / 3.0, 1e-15);
}

TEST(KolmogorovSmirnov, PValuesOfUniformSamplesAreUniform) {
  // 2000 p-values: their own test must not reject at 1e-4. Seed fixed.
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> p_values;
  for (int run = 0; run < 2000; ++run) {
    std::vector<double> values(30);
    for (double& value : values) value = uniform(random);
    p_values.push_back(KolmogorovSmirnovUniform(values).p_value);
  }
  EXPECT_GT(KolmogorovSmirnovUniform(p_values).p_value, 1e-4);
}

TEST(KolmogorovSmirnov, SeesTheWrongDistribution) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> values(500);
  for (double& value : values) value = std::sqrt(uniform(random));
  EXPECT_LT(KolmogorovSmirnovUniform(values).p_value, 1e-9);
}

}  // namespace kolmogorov_smirnov_test
}  // namespace truetriad
