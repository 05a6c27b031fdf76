// SPDX-License-Identifier: Apache-2.0
#include "math/distributions.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Table values: NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7, to the digits printed
// there; the tolerance is half of the last digit.
TEST(Distributions, AgreeWithPublishedTables) {
  EXPECT_NEAR(NormalQuantile(0.975), 1.959964, 5e-7);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 1), 3.841, 5e-4);
  EXPECT_NEAR(ChiSquareQuantile(0.99, 10), 23.209, 5e-4);
  EXPECT_NEAR(ChiSquareQuantile(0.001, 100), 61.918, 5e-4);
  EXPECT_NEAR(FisherQuantile(0.95, 3, 10), 3.708, 5e-4);
  EXPECT_NEAR(FisherQuantile(0.99, 5, 20), 4.103, 5e-4);
  EXPECT_NEAR(StudentQuantile(0.975, 10), 2.228, 5e-4);
  EXPECT_NEAR(StudentQuantile(0.999, 3), 10.215, 5e-4);
}

TEST(Distributions, CdfUndoesQuantile) {
  // 1e-12: both are iterated to within a few hundred epsilon.
  for (const double p : {1e-6, 0.05, 0.5, 0.999}) {
    for (const double dof : {0.5, 3.0, 12.7, 400.0}) {
      EXPECT_NEAR(ChiSquareCdf(ChiSquareQuantile(p, dof), dof), p, 1e-12);
      EXPECT_NEAR(FisherCdf(FisherQuantile(p, dof, 7.5), dof, 7.5), p, 1e-12);
    }
  }
}

TEST(Distributions, TakeInfiniteDegreesOfFreedomAsKnownNoise) {
  EXPECT_DOUBLE_EQ(FisherQuantile(0.95, 4, kInfinity), ChiSquareQuantile(0.95, 4) / 4);
  EXPECT_DOUBLE_EQ(FisherCdf(1.5, 4, kInfinity), ChiSquareCdf(6.0, 4));
  EXPECT_NEAR(StudentQuantile(0.9, kInfinity), NormalQuantile(0.9), 1e-14);
  // The difference falls as 1/dof.
  EXPECT_NEAR(FisherQuantile(0.95, 4, 1e9), FisherQuantile(0.95, 4, kInfinity), 1e-7);
}

TEST(Distributions, ReachTheEndsOfTheirRange) {
  EXPECT_EQ(ChiSquareCdf(0.0, 3), 0.0);
  EXPECT_EQ(ChiSquareCdf(kInfinity, 3), 1.0);
  EXPECT_EQ(FisherCdf(0.0, 3, 4), 0.0);
  EXPECT_EQ(FisherCdf(kInfinity, 3, 4), 1.0);
}

TEST(DistributionsDeathTest, ArgumentsOutOfRangeAreProgrammersMistakes) {
  EXPECT_DEATH(NormalQuantile(1.0), "probability");
  EXPECT_DEATH(ChiSquareCdf(-1.0, 3), "value");
  EXPECT_DEATH(ChiSquareCdf(std::nan(""), 3), "value");
  EXPECT_DEATH(FisherQuantile(0.5, 3, 0.0), "degrees of freedom");
  EXPECT_DEATH(Median({}), "empty");
}

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

TEST(Median, IsTheMiddleOrTheMeanOfTheTwoInTheMiddle) {
  EXPECT_EQ(Median({3.0}), 3.0);
  EXPECT_EQ(Median({9.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(Median({9.0, 1.0, 2.0, 4.0}), 3.0);
  EXPECT_EQ(Median({-1.0, -1.0, 5.0, 5.0, -1.0}), -1.0);
}

}  // namespace
}  // namespace truetriad
