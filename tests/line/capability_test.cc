// SPDX-License-Identifier: Apache-2.0
#include "line/capability.h"

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace truetriad::line {
namespace capability_test {

constexpr double kOpen = std::numeric_limits<double>::infinity();

Eigen::VectorXd Drawn(int count, double mean, double sigma, std::mt19937_64* random) {
  std::normal_distribution<double> normal(mean, sigma);
  Eigen::VectorXd values(count);
  for (double& value : values) value = normal(*random);
  return values;
}

TEST(Capability, IsThatOfTheTextbook) {
  Eigen::VectorXd values(6);
  values << 1.0, 2.0, 4.0, 3.0, 2.0, 3.0;
  const Capability found = FindCapability({.values = values, .lower = -1.0, .upper = 6.0});
  EXPECT_EQ(found.units, 6);
  EXPECT_DOUBLE_EQ(found.mean, 2.5);
  // Sum of squares 5.5; moving ranges 1, 2, 1, 1, 1.
  const double overall = std::sqrt(5.5 / 5.0), within = 1.2 / 1.1283791670955126;
  EXPECT_NEAR(found.observed.overall.sigma.value, overall, 1e-14);
  EXPECT_NEAR(found.observed.within.sigma.value, within, 1e-14);
  EXPECT_NEAR(found.observed.overall.cp.value, 7.0 / (6.0 * overall), 1e-13);
  EXPECT_NEAR(found.observed.within.cpk.value, 3.5 / (3.0 * within), 1e-13);
  EXPECT_EQ(found.observed_outside, 0.0);
}

TEST(Capability, HasOneSideWhereTheOtherIsOpen) {
  Eigen::VectorXd values(4);
  values << 1.0, 2.0, 3.0, 4.0;
  const Capability above = FindCapability({.values = values, .upper = 3.5});
  EXPECT_TRUE(std::isnan(above.observed.overall.cp.value));
  EXPECT_NEAR(above.observed.overall.cpk.value, 1.0 / (3.0 * std::sqrt(5.0 / 3.0)), 1e-14);
  EXPECT_EQ(above.observed_outside, 0.25);
  const Capability none = FindCapability({.values = values});
  EXPECT_TRUE(std::isnan(none.observed.overall.cpk.value));
  EXPECT_TRUE(std::isnan(none.observed.overall.expected_outside));
  EXPECT_TRUE(std::isnan(none.observed_outside));
}

TEST(Capability, TakesTheVarianceOfCalibrationOut) {
  std::mt19937_64 random(3);
  const int count = 4000;
  const Eigen::VectorXd values = Drawn(count, 0.0, 3.0, &random) + Drawn(count, 0.0, 4.0, &random);
  const Capability found = FindCapability({.values = values,
                                           .sigma = Eigen::VectorXd::Constant(count, 4.0),
                                           .lower = -20.0,
                                           .upper = 20.0});
  // Of 25 - 16 the first has a relative σ of sqrt(2 / 4000), so the root of 9 has one of 3.1 %.
  EXPECT_NEAR(found.observed.overall.sigma.value, 5.0, 4 * 5.0 * 0.5 * 0.0224);
  EXPECT_NEAR(found.process.overall.sigma.value, 3.0, 4 * 3.0 * 0.031);
  EXPECT_NEAR(found.process.within.sigma.value, 3.0, 4 * 3.0 * 0.031 * 1.3);
  EXPECT_LT(found.process.overall.expected_outside, found.observed.overall.expected_outside);
}

TEST(Capability, OfAProcessBelowTheCalibrationIsOpenUpward) {
  std::mt19937_64 random(4);
  const Capability found = FindCapability({.values = Drawn(50, 0.5, 1.0, &random),
                                           .sigma = Eigen::VectorXd::Constant(50, 2.0),
                                           .lower = -10.0,
                                           .upper = 10.0});
  EXPECT_EQ(found.process.overall.sigma.value, 0.0);
  EXPECT_EQ(found.process.overall.cpk.value, kOpen);
  EXPECT_EQ(found.process.overall.cpk.interval.upper, kOpen);
  EXPECT_EQ(found.process.overall.expected_outside, 0.0);
  EXPECT_FALSE(std::isnan(found.process.overall.cpk.interval.lower));
}

TEST(Capability, HoldsLittleOfFewUnitsAgainstThem) {
  EXPECT_EQ(FindCapability({}).units, 0);
  const Capability one = FindCapability({.values = Eigen::VectorXd::Ones(1), .upper = 2.0});
  EXPECT_TRUE(std::isnan(one.observed.overall.cpk.value));
  EXPECT_EQ(one.mean, 1.0);
}

// 1 / (2 dof) is the relative variance of the spread: by simulation of 20,000 lines of 40 units,
// whose own doubt is 1 %.
TEST(Spread, OfMovingRangesHasTheDegreesOfFreedomThatItStates) {
  std::mt19937_64 random(5);
  constexpr int kLines = 20'000;
  double sum = 0.0, squares = 0.0, dof = 0.0;
  for (int i = 0; i < kLines; ++i) {
    const Spread spread = MovingRangeSpread(Drawn(40, 0.0, 1.0, &random));
    dof = spread.dof;
    sum += spread.ProcessSigma();
    squares += spread.variance;
  }
  const double mean = sum / kLines;
  EXPECT_NEAR(mean, 1.0, 0.004);
  EXPECT_NEAR((squares / kLines - mean * mean) * 2.0 * dof, 1.0, 0.04);
}

/// How often intervals hold the truth, of lines of `count` units with calibrations of `calibration`
/// σ and a process of 1 σ, at `offset` from the middle of limits at -+ 4.
struct Coverage {
  double cp = 0.0, cpk = 0.0, pp = 0.0, ppk = 0.0, process_pp = 0.0, process_ppk = 0.0;
};
Coverage CoverageOf(int count, double calibration, double offset) {
  std::mt19937_64 random(11);
  constexpr int kLines = 3000;
  const auto holds = [](const Estimate& estimate, double truth) {
    return estimate.interval.lower <= truth && truth <= estimate.interval.upper ? 1.0 / kLines
                                                                                : 0.0;
  };
  const double observed = std::hypot(1.0, calibration);
  Coverage coverage;
  for (int i = 0; i < kLines; ++i) {
    const Capability found = FindCapability({.values = Drawn(count, offset, observed, &random),
                                             .sigma = Eigen::VectorXd::Constant(count, calibration),
                                             .lower = -4.0,
                                             .upper = 4.0});
    const double cp = 4.0 / 3.0, cpk = (4.0 - offset) / 3.0;
    coverage.cp += holds(found.observed.within.cp, cp / observed);
    coverage.cpk += holds(found.observed.within.cpk, cpk / observed);
    coverage.pp += holds(found.observed.overall.cp, cp / observed);
    coverage.ppk += holds(found.observed.overall.cpk, cpk / observed);
    coverage.process_pp += holds(found.process.overall.cp, cp);
    coverage.process_ppk += holds(found.process.overall.cpk, cpk);
  }
  return coverage;
}

// 3,000 lines: 3 sigma of a share of 95 % are 1.2 %. Seen: 94.5 to 95.4 %.
TEST(Capability, IntervalsHoldTheTruthAsOftenAsTheySay) {
  for (const int count : {15, 60}) {
    for (const double calibration : {0.0, 0.7}) {
      SCOPED_TRACE(testing::Message() << count << " units, calibration " << calibration);
      const Coverage coverage = CoverageOf(count, calibration, 1.0);
      EXPECT_NEAR(coverage.cp, 0.95, 0.015);
      EXPECT_NEAR(coverage.cpk, 0.95, 0.015);
      EXPECT_NEAR(coverage.pp, 0.95, 0.015);
      EXPECT_NEAR(coverage.ppk, 0.95, 0.015);
      EXPECT_NEAR(coverage.process_pp, 0.95, 0.015);
      EXPECT_NEAR(coverage.process_ppk, 0.95, 0.015);
    }
  }
}

// statsmodels.stats.diagnostic.normal_ad (0.13.5).
TEST(AndersonDarling, AgreesWithStatsmodels) {
  Eigen::VectorXd values(12);
  values << 4.1, 5.3, 3.9, 4.8, 5.1, 4.4, 6.9, 4.6, 5.0, 4.2, 4.7, 5.5;
  EXPECT_NEAR(AndersonDarlingP(values), 0.25602442970288264, 1e-9);
  const Eigen::VectorXd skewed = Eigen::VectorXd::LinSpaced(30, -1.5, 2.5).array().exp();
  EXPECT_NEAR(AndersonDarlingP(skewed), 1.9284522322855788e-05, 1e-12);
}

TEST(AndersonDarling, IsNothingWhereNothingVaries) {
  EXPECT_TRUE(std::isnan(AndersonDarlingP(Eigen::VectorXd::Ones(50))));
  EXPECT_TRUE(std::isnan(AndersonDarlingP(Eigen::VectorXd::LinSpaced(7, 0.0, 1.0))));
  // Further from normal than any table goes.
  Eigen::VectorXd far = Eigen::VectorXd::Zero(5000);
  far[0] = 1e6;
  EXPECT_LT(AndersonDarlingP(far), 1e-20);
}

// 10 of 100: the interval of Wilson as in Newcombe (1998), formula 3.
TEST(Share, HasTheIntervalOfWilson) {
  const Estimate share = ShareOf(10, 100);
  EXPECT_NEAR(share.interval.lower, 0.0552, 5e-5);
  EXPECT_NEAR(share.interval.upper, 0.1744, 5e-5);
  EXPECT_EQ(ShareOf(0, 50).interval.lower, 0.0);
  EXPECT_EQ(ShareOf(50, 50).interval.upper, 1.0);
  EXPECT_TRUE(std::isnan(ShareOf(0, 0).value));
}

}  // namespace capability_test
}  // namespace truetriad::line
