// SPDX-License-Identifier: Apache-2.0
#include "math/distributions.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace distributions_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Table values: NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7, to the digits printed
// there; the tolerance is half of the last digit.
TEST(Distributions, AgreeWithPublishedTables) {
  EXPECT_NEAR(NormalQuantile(0.975), 1.959964, 5e-7);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 1), 3.841, 5e-4);
  EXPECT_NEAR(ChiSquareQuantile(0.99, 10), 23.209, 5e-4);
  EXPECT_NEAR(ChiSquareQuantile(0.001, 100), 61.918, 5e-4);
  // Half of the last digit times the density, which is below 0.04 there.
  EXPECT_NEAR(FisherCdf(3.708, 3, 10), 0.95, 2e-5);
  EXPECT_NEAR(FisherCdf(4.103, 5, 20), 0.99, 2e-5);
  EXPECT_NEAR(FisherQuantile(0.95, 3, 10), 3.708, 5e-4);
  EXPECT_NEAR(NormalCdf(1.959964), 0.975, 5e-8);
  EXPECT_NEAR(StudentQuantile(0.975, 10), 2.228, 5e-4);
  EXPECT_NEAR(StudentQuantile(0.999, 3), 10.215, 5e-4);
}

TEST(Distributions, CdfUndoesQuantile) {
  // 1e-12: both are iterated to within a few hundred epsilon.
  for (const double p : {1e-6, 0.05, 0.5, 0.999}) {
    for (const double dof : {0.5, 3.0, 12.7, 400.0}) {
      EXPECT_NEAR(ChiSquareCdf(ChiSquareQuantile(p, dof), dof), p, 1e-12);
    }
  }
  // The square of Student's t is F with one degree of freedom above.
  for (const double p : {0.51, 0.9, 0.999}) {
    const double t = StudentQuantile(p, 7.5);
    EXPECT_NEAR(FisherCdf(t * t, 1.0, 7.5), 2.0 * p - 1.0, 1e-12);
  }
}

TEST(Distributions, TakeInfiniteDegreesOfFreedomAsKnownNoise) {
  EXPECT_DOUBLE_EQ(FisherCdf(1.5, 4, kInfinity), ChiSquareCdf(6.0, 4));
  EXPECT_DOUBLE_EQ(FisherQuantile(0.3, 4, kInfinity), ChiSquareQuantile(0.3, 4) / 4);
  EXPECT_NEAR(StudentQuantile(0.9, kInfinity), NormalQuantile(0.9), 1e-14);
  // The difference falls as 1/dof.
  EXPECT_NEAR(FisherCdf(2.37, 4, 1e9), FisherCdf(2.37, 4, kInfinity), 1e-7);
}

TEST(LowerQuantile, IsTheLowerOfTwoValues) {
  const std::vector<double> values = {5.0, 1.0, 4.0, 2.0, 3.0, 6.0};
  EXPECT_EQ(LowerQuantile(values, 0.0), 1.0);
  EXPECT_EQ(LowerQuantile(values, 0.5), 3.0);
  EXPECT_EQ(LowerQuantile(values, 0.8), 5.0);
  EXPECT_EQ(LowerQuantile(values, 0.99), 5.0);
  EXPECT_EQ(LowerQuantile(values, 1.0), 6.0);
}

TEST(Distributions, ReachTheEndsOfTheirRange) {
  EXPECT_EQ(ChiSquareCdf(0.0, 3), 0.0);
  EXPECT_EQ(ChiSquareCdf(kInfinity, 3), 1.0);
  EXPECT_EQ(FisherCdf(0.0, 3, 4), 0.0);
  EXPECT_EQ(FisherCdf(kInfinity, 3, 4), 1.0);
  // The lower tail has all its digits (Abramowitz & Stegun, table 26.2: -log10 is 23.11805).
  EXPECT_NEAR(-std::log10(NormalCdf(-10.0)), 23.11805, 5e-6);
  EXPECT_EQ(NormalCdf(kInfinity), 1.0);
  EXPECT_EQ(NormalCdf(-kInfinity), 0.0);
}

// python3, scipy: stats.f.sf(12, 3, 40), stats.f.isf(1e-6, 5, 167)
TEST(Distributions, AgreeWithScipy) {
  // 1e-12, relative: both iterate to within some hundred epsilon.
  EXPECT_NEAR(FisherUpper(12.0, 3, 40) / 9.654458319372911e-06, 1.0, 1e-12);
  EXPECT_NEAR(FisherUpperQuantile(1e-6, 5, 167), 7.929741983253847, 1e-11);
}

TEST(DistributionsDeathTest, ArgumentsOutOfRangeAreProgrammersMistakes) {
  EXPECT_DEATH(NormalQuantile(1.0), "probability");
  EXPECT_DEATH(ChiSquareCdf(-1.0, 3), "value");
  EXPECT_DEATH(ChiSquareCdf(std::nan(""), 3), "value");
  EXPECT_DEATH(FisherCdf(0.5, 3, 0.0), "degrees of freedom");
  EXPECT_DEATH(Median({}), "empty");
}

TEST(Median, IsTheMiddleOrTheMeanOfTheTwoInTheMiddle) {
  EXPECT_EQ(Median({3.0}), 3.0);
  EXPECT_EQ(Median({9.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(Median({9.0, 1.0, 2.0, 4.0}), 3.0);
  EXPECT_EQ(Median({-1.0, -1.0, 5.0, 5.0, -1.0}), -1.0);
}

}  // namespace distributions_test
}  // namespace truetriad
