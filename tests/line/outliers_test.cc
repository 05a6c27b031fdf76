// SPDX-License-Identifier: Apache-2.0
#include "line/outliers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "line/simulated_lines.h"

namespace truetriad::line {
namespace outliers_test {

// 300 lines: with a level of 5 % 15 ± 3.8 of them have one. Also of as few units as are taken.
TEST(Outliers, OfNormalUnitsAreAsRareAsStated) {
  for (const auto& [parameters, units] : {std::pair(10, 200), {20, 80}}) {
    int found = 0;
    for (int line = 0; line < 300; ++line) {
      SimulatedLine simulated(parameters, static_cast<std::uint64_t>(line));
      OutlierOptions options;
      options.level = 0.05;
      found += Outliers(simulated.Units(units), options).outliers.empty() ? 0 : 1;
    }
    std::printf("@outliers | %d | %d | %d |\n", parameters, units, found);
    EXPECT_NEAR(found, 15, 3.5 * 3.8);
  }
}

// A fifth of the units is elsewhere, all at the same place, which inflates an ordinary covariance
// until they look normal.
TEST(Outliers, DoNotHideEachOther) {
  SimulatedLine simulated(10, 1);
  LineData data = simulated.Units(300);
  for (std::size_t unit = 0; unit < 60; ++unit) {
    data.units[5 * unit].values[3] += 15.0 * SimulatedLine::ScaleOf(3);
  }
  const OutlierReport report = Outliers(data);
  EXPECT_EQ(report.outliers.size(), 60U);
  for (const Outlier& outlier : report.outliers) {
    EXPECT_EQ(outlier.unit % 5, 0);
    EXPECT_EQ(outlier.shares.front().parameter, 3);
  }
}

// A bad lot, a quarter of the units: by 4 σ in every parameter, up or down. Correlations of it hide
// it from a start that follows them.
TEST(Outliers, OfALotThatIsOffInAllParametersDoNotHideEachOther) {
  for (const int common : {0, 5}) {
    SimulatedLine simulated(33, 6, common);
    LineData data = simulated.Units(400);
    for (std::size_t unit = 0; unit < 400; unit += 4) {
      for (Eigen::Index k = 0; k < 33; ++k) {
        data.units[unit].values[k] += (k % 3 == 0 ? -4.0 : 4.0) * SimulatedLine::ScaleOf(k);
      }
    }
    const OutlierReport report = Outliers(data);
    EXPECT_GE(report.outliers.size(), 100U) << common;
    EXPECT_LE(report.outliers.size(), 101U) << common;
    for (std::size_t k = 0; k < std::min<std::size_t>(report.outliers.size(), 100); ++k) {
      EXPECT_EQ(report.outliers[k].unit % 4, 0) << common;
    }
  }
}

// What no parameter shows by itself: two that always agree differ.
TEST(Outliers, AreSeenInParametersTogether) {
  SimulatedLine simulated(4, 2);
  LineData data = simulated.Units(400);
  data.parameters.push_back("twin");
  for (UnitRecord& unit : data.units) {
    unit.values.conservativeResize(5);
    unit.values[4] = unit.values[0] + 0.05 * simulated.random().Normal();
  }
  data.units[123].values[4] = data.units[123].values[0] + 1.0;
  const OutlierReport report = Outliers(data);
  ASSERT_EQ(report.outliers.size(), 1U);
  EXPECT_EQ(report.outliers[0].unit, 123);
  EXPECT_LT(std::abs(report.outliers[0].shares[0].deviation), 4.0);
  EXPECT_GT(std::abs(report.outliers[0].shares[0].conditional), 10.0);
}

TEST(Outliers, NeedNoParameterThatIsFixedOrTied) {
  SimulatedLine simulated(3, 3);
  LineData data = simulated.Units(100);
  data.parameters.insert(data.parameters.end(), {"fixed", "tied"});
  for (UnitRecord& unit : data.units) {
    unit.values.conservativeResize(5);
    unit.values[3] = 0.0;
    unit.values[4] = -2.0 * unit.values[1];
  }
  data.units[7].values[0] = std::nan("");
  const OutlierReport report = Outliers(data);
  ASSERT_EQ(report.sets.size(), 1U);
  EXPECT_EQ(report.sets[0].parameters, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(report.sets[0].units, 99);
  EXPECT_TRUE(std::isnan(report.distances[7]));
}

// Clipped values are no sum any more, and one unit in a hundred breaks a tie of the others.
TEST(Outliers, AreFoundWhereAParameterIsASumOfOthers) {
  for (const bool is_broken : {false, true}) {
    SimulatedLine simulated(5, 9);
    LineData data = simulated.Units(100);
    data.units[40].values[1] += 30.0 * SimulatedLine::ScaleOf(1);
    data.parameters.push_back("sum");
    for (UnitRecord& unit : data.units) {
      unit.values.conservativeResize(6);
      unit.values[5] = unit.values[0] + unit.values[1];
    }
    if (is_broken) data.units[3].values[5] += 5.0 * SimulatedLine::ScaleOf(0);
    const OutlierReport report = Outliers(data);
    ASSERT_EQ(report.outliers.size(), 1U) << is_broken;
    EXPECT_EQ(report.outliers[0].unit, 40);
    EXPECT_EQ(report.sets[0].parameters, (std::vector<int>{0, 1, 2, 3, 4}));
    const std::string note =
        "sum is left out of outliers: in most units, but not in all, other parameters determine it";
    EXPECT_EQ(report.notes, is_broken ? std::vector{note} : std::vector<std::string>());
  }
}

TEST(Outliers, AreNotLookedForInAParameterThatIsTheSameInMostUnitsWhichIsSaid) {
  SimulatedLine simulated(4, 10);
  LineData data = simulated.Units(100);
  for (std::size_t unit = 0; unit < 100; ++unit) {
    data.units[unit].serial = "U" + std::to_string(unit);
    data.units[unit].values[2] = unit == 40 ? 50.0 : 0.0;
  }
  const OutlierReport report = Outliers(data);
  EXPECT_EQ(report.notes,
            std::vector{data.parameters[2] +
                        " is left out of outliers: most units have the same value of it; 1 has "
                        "another: U40"});
}

// The median of an odd number of units is one of them.
TEST(Outliers, OfASingleParameterAreFound) {
  SimulatedLine simulated(1, 8);
  LineData data = simulated.Units(41);
  data.units[17].values[0] += 12.0;
  const OutlierReport report = Outliers(data);
  ASSERT_EQ(report.outliers.size(), 1U);
  EXPECT_EQ(report.outliers[0].unit, 17);
}

TEST(Outliers, AreNotLookedForInTooFewUnits) {
  SimulatedLine simulated(33, 4);
  const std::string few =
      "no outliers looked for: it takes 132 units with all 33 parameters, and there are 100";
  EXPECT_EQ(Outliers(simulated.Units(100)).notes, std::vector{few});
  // 5 units determine no more than 4 parameters.
  const std::string five =
      "no outliers looked for: it takes 132 units with all 33 parameters, and there are 5";
  EXPECT_EQ(Outliers(simulated.Units(5)).notes, std::vector{five});
  EXPECT_TRUE(Outliers(LineData{}).sets.empty());
}

// S2 has not the last three of six parameters, S3 not the first one, and few units.
TEST(Outliers, AreJudgedByTheParametersOfTheirStation) {
  SimulatedLine simulated(6, 7);
  LineData data = simulated.Units(310);
  for (std::size_t unit = 0; unit < 310; ++unit) {
    UnitRecord& record = data.units[unit];
    record.tags["station"] = unit >= 300 ? "S3" : unit % 3 == 0 ? "S2" : "S1";
    if (record.tags["station"] == "S2") record.values.tail(3).setConstant(std::nan(""));
    if (record.tags["station"] == "S3") record.values[0] = std::nan("");
  }
  for (const std::size_t unit : {30, 31}) {  // of S2 and of S1
    data.units[unit].values[1] += 12.0 * SimulatedLine::ScaleOf(1);
  }
  const OutlierReport report = Outliers(data);
  EXPECT_EQ(report.sets.size(), 2U);
  ASSERT_EQ(report.outliers.size(), 2U);
  EXPECT_EQ(report.outliers[0].unit + report.outliers[1].unit, 30 + 31);
  EXPECT_EQ(report.notes,
            std::vector<std::string>{
                "no outliers looked for among 10 units at S3 that have other parameters: it takes "
                "20 units with all 5 parameters, and there are 10"});
}

}  // namespace outliers_test
}  // namespace truetriad::line
