// SPDX-License-Identifier: Apache-2.0
#include "line/trend.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "math/fast_random.h"

namespace truetriad::line {
namespace trend_test {

std::string MinuteOf(std::size_t minute) {
  char text[64];
  std::snprintf(text,
                sizeof text,
                "2026-01-%02zuT%02zu:%02zu:00Z",
                1 + minute / 1440,
                minute / 60 % 24,
                minute % 60);
  return text;
}

// A unit a minute.
LineData LineOf(const std::vector<double>& values) {
  LineData data;
  data.parameters = {"a"};
  for (const double value : values) {
    UnitRecord unit;
    unit.recorded = MinuteOf(data.units.size());
    unit.values = Eigen::VectorXd::Constant(1, value);
    data.units.push_back(unit);
  }
  return data;
}

// In Python by their definitions: 11 times slope and standard error, Student with 10 degrees of
// freedom in its closed form.
TEST(Trend, IsOfLeastSquares) {
  const std::vector<double> y = {1.0, 2.5, 1.7, 2.2, 3.1, 2.5, 3.9, 3.0, 4.4, 3.7, 4.1, 5.0};
  const TrendReport report = Trends(LineOf(y));
  ASSERT_EQ(report.trends.size(), 1U);
  EXPECT_EQ(report.last, "2026-01-01T00:11:00Z");
  EXPECT_EQ(report.trends[0].inflation, 1.0);
  EXPECT_NEAR(report.trends[0].change, 3.25, 1e-9);
  EXPECT_NEAR(report.trends[0].sigma, 0.480291044242, 1e-9);
  EXPECT_NEAR(report.trends[0].p, 4.93903192949e-05, 1e-12);
  EXPECT_EQ(report.note, "");
}

TEST(Trend, IsTheChangeOverTheTimeOfAllUnitsWhateverTheirOrder) {
  FastRandom random({21});
  std::vector<double> values;
  for (int unit = 0; unit < 240; ++unit) {
    values.push_back(5.0 + 3.0 * unit / 239.0 + 0.1 * random.Normal());
  }
  LineData data = LineOf(values);
  data.units[100].values[0] = 1e6;  // one spoilt unit is no trend
  const Trend trend = Trends(data).trends.at(0);
  EXPECT_EQ(trend.units, 239);
  EXPECT_NEAR(trend.change, 3.0, 4.0 * trend.sigma);
  EXPECT_NEAR(trend.sigma, 0.1 * std::sqrt(12.0 / 240.0), 0.15 * 0.022);
  EXPECT_LT(trend.p_adjusted, 1e-12);
  std::reverse(data.units.begin(), data.units.end());
  const Trend reversed = Trends(data).trends.at(0);
  EXPECT_EQ(reversed.change, trend.change);
  EXPECT_EQ(reversed.p, trend.p);
}

TEST(Trend, IsNoneWhereNoTimeIsKnown) {
  LineData data = LineOf({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11.5, 12});
  for (UnitRecord& unit : data.units) unit.recorded = "2026-01-01T00:00:00Z";
  EXPECT_TRUE(Trends(data).trends.empty());
  EXPECT_EQ(Trends(data).note, "all units were measured at the same moment, 2026-01-01T00:00:00Z");
  for (UnitRecord& unit : data.units) unit.recorded.clear();
  EXPECT_TRUE(Trends(data).trends.empty());
  EXPECT_EQ(Trends(data).note, "no unit's time of measurement is known");
  for (std::size_t k = 1; k < 12; ++k) data.units[k].recorded = MinuteOf(k);
  EXPECT_EQ(Trends(data).trends.size(), 1U);
  EXPECT_EQ(Trends(data).note,
            "1 of 12 units have no part in trends: their time of measurement is not known");
}

// 300 lines without trend, each unit half the one before: 5 % of tests are 15 ± 3.8. Without the
// correction σ of the change is too small by sqrt(3), and a quarter of them would find one.
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
    found += Trends(LineOf(correlated)).trends[0].p < 0.05 ? 1 : 0;
    independent_found += Trends(LineOf(independent)).trends[0].p < 0.05 ? 1 : 0;
  }
  std::printf("@trends | %d | %d |\n", found, independent_found);
  EXPECT_LE(found, 15 + 3.5 * 3.8);
  EXPECT_LE(independent_found, 15 + 3.5 * 3.8);
}

// One station makes the first half of the units, another, whose units have 3 σ more, the second.
TEST(Trend, IsNotOfTheStationsThatTakeOver) {
  FastRandom random({23});
  std::vector<double> values;
  for (int unit = 0; unit < 200; ++unit) values.push_back(random.Normal() + (unit < 100 ? 0 : 3));
  LineData data = LineOf(values);
  EXPECT_LT(Trends(data).trends[0].p, 1e-6);
  for (std::size_t k = 0; k < 200; ++k) data.units[k].tags["station"] = k < 100 ? "S1" : "S2";
  EXPECT_GT(Trends(data).trends[0].p, 0.05);
}

}  // namespace trend_test
}  // namespace truetriad::line
