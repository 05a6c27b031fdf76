// SPDX-License-Identifier: Apache-2.0
#include "line/trend.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "math/fast_random.h"

namespace truetriad::line {
namespace trend_test {

LineData LineOf(const std::vector<double>& values) {
  LineData data;
  data.parameters = {"a"};
  for (const double value : values) {
    UnitRecord unit;
    unit.values = Eigen::VectorXd::Constant(1, value);
    data.units.push_back(unit);
  }
  return data;
}

// python3, scipy: y=[...]; stats.theilslopes(y).slope; and S, its variance with ties by hand:
//   S=sum(np.sign(y[j]-y[i]) for i in range(n) for j in range(i+1,n)); var=(n(n-1)(2n+5)-2*9)/18
TEST(Trend, AgreesWithScipy) {
  const std::vector<double> y = {1.0, 2.5, 1.7, 2.2, 3.1, 2.5, 3.9, 3.0, 4.4, 3.7, 4.1, 5.0};
  const TrendReport report = Trends(LineOf(y));
  EXPECT_FALSE(report.by_time);
  ASSERT_EQ(report.time.size(), 1U);
  EXPECT_NEAR(report.time[0].slope, 0.3, 1e-12);
  EXPECT_EQ(report.time[0].inflation, 1.0);
  EXPECT_NEAR(report.time[0].p, 0.000969441196256, 1e-10);
  EXPECT_TRUE(report.temperature.empty());
}

TEST(Trend, IsPerDayWhereMomentsAreKnown) {
  LineData data;
  data.parameters = {"a"};
  FastRandom random({21});
  for (int unit = 0; unit < 240; ++unit) {
    UnitRecord record;
    const int hour = unit / 10;
    const int minute = unit % 10 * 6;
    record.created = "2026-01-31T" + std::string(hour < 10 ? "0" : "") + std::to_string(hour) +
                     ":" + std::string(minute < 10 ? "0" : "") + std::to_string(minute) + ":00Z";
    record.values = Eigen::VectorXd::Constant(1, 5.0 + 3.0 * unit / 240.0 + 0.1 * random.Normal());
    record.tags["temperature"] = std::to_string(20.0 + unit % 7);
    data.units.push_back(record);
  }
  data.units[100].values[0] = 1e6;  // one spoilt unit is no trend
  const TrendReport report = Trends(data);
  EXPECT_TRUE(report.by_time);
  ASSERT_EQ(report.time.size(), 1U);
  EXPECT_NEAR(report.time[0].slope, 3.0, 4.0 * report.time[0].sigma);
  // Least squares: 0.1 sqrt(12 / 240) a day; Theil and Sen's estimate has 96 % of its efficiency.
  EXPECT_NEAR(report.time[0].sigma, 0.1 * std::sqrt(12.0 / 240.0), 0.15 * 0.022);
  EXPECT_NEAR(report.time[0].intercept, 5.0, 0.1);
  EXPECT_LT(report.time[0].p_adjusted, 1e-12);
  ASSERT_EQ(report.temperature.size(), 1U);
  EXPECT_GT(report.temperature[0].p, 0.01);
}

// 300 lines without trend, each unit half the one before: 5 % of tests are 15 ± 3.8. Without the
// correction σ of the statistic is too small by sqrt(3), and a quarter of them would find one.
TEST(Trend, IsNotSeenInAutocorrelatedUnits) {
  FastRandom random({22});
  int found = 0;
  int independent_found = 0;
  for (int line = 0; line < 300; ++line) {
    std::vector<double> correlated, independent;
    double before = 0.0;
    for (int unit = 0; unit < 200; ++unit) {
      before = 0.5 * before + random.Normal();
      correlated.push_back(before);
      independent.push_back(random.Normal());
    }
    found += Trends(LineOf(correlated)).time[0].p < 0.05 ? 1 : 0;
    independent_found += Trends(LineOf(independent)).time[0].p < 0.05 ? 1 : 0;
  }
  EXPECT_LE(found, 15 + 3.5 * 3.8);
  EXPECT_LE(independent_found, 15 + 3.5 * 3.8);
}

// One station makes the first half of the units, another, whose units have 3 σ more, the second.
TEST(Trend, IsNotOfTheStationsThatTakeOver) {
  FastRandom random({23});
  std::vector<double> values;
  for (int unit = 0; unit < 200; ++unit) values.push_back(random.Normal() + (unit < 100 ? 0 : 3));
  LineData data = LineOf(values);
  EXPECT_LT(Trends(data).time[0].p, 1e-6);
  for (std::size_t k = 0; k < 200; ++k) data.units[k].tags["station"] = k < 100 ? "S1" : "S2";
  EXPECT_GT(Trends(data).time[0].p, 0.05);
}

// At 3 set-points, with 4 values. S is 33, its variance over all orders of y 159.61 (Kendall's
// formula, which for 7 units agrees with all their orders; 212.7 without ties), p = 2 Φ(-32 / σ).
TEST(Trend, AllowsForTiesInBoth) {
  LineData data = LineOf({1, 2, 2, 1, 2, 3, 2, 2, 3, 3, 2, 4});
  for (std::size_t k = 0; k < 12; ++k) {
    data.units[k].tags["temperature"] = std::to_string(20 + 5 * (k / 4));
  }
  const Trend trend = Trends(data).temperature.at(0);
  EXPECT_NEAR(trend.p, 0.0113125102671, 1e-9);
}

// A chamber that warms through the day, and one that does not. Ranks 1 2 3 4.5 4.5 6 7 8 9 10.
TEST(Trend, SaysWhetherTemperatureGoesWithTime) {
  LineData data = LineOf({1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  EXPECT_TRUE(std::isnan(Trends(data).temperature_with_time));
  for (std::size_t k = 0; k < 10; ++k) {
    data.units[k].tags["temperature"] = std::to_string(20 + (k < 4 ? k : k - 1));
  }
  // Squares about the mean: 82.5 of places, 82 of ranks with a tie, 82 of both together.
  EXPECT_NEAR(Trends(data).temperature_with_time, 82.0 / std::sqrt(82.5 * 82.0), 1e-12);
  for (std::size_t k = 0; k < 10; ++k) {
    data.units[k].tags["temperature"] = std::to_string(k % 2 == 0 ? 20 : 30);
  }
  EXPECT_LT(std::abs(Trends(data).temperature_with_time), 0.3);
}

}  // namespace trend_test
}  // namespace truetriad::line
