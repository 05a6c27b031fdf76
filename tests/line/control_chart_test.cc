// SPDX-License-Identifier: Apache-2.0
#include "line/control_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "line/chart_plan.h"
#include "line/simulated_lines.h"
#include "support/nightly.h"

namespace truetriad::line {
namespace control_chart_test {

constexpr int kParameters = 33;

int RunLines() { return IsNightly() ? 500 : 20; }

struct RunLengths {
  double mean = 0.0, sigma = 0.0;  // of the mean
  int lines = 0;
  double median = 0.0;
};

RunLengths Summary(std::vector<double> runs) {
  RunLengths result;
  result.lines = static_cast<int>(runs.size());
  result.mean = std::accumulate(runs.begin(), runs.end(), 0.0) / result.lines;
  double squares = 0.0;
  for (const double run : runs) squares += std::pow(run - result.mean, 2);
  result.sigma = std::sqrt(squares / (result.lines - 1.0) / result.lines);
  std::sort(runs.begin(), runs.end());
  result.median = runs[runs.size() / 2];
  return result;
}

// Units from the first after the baseline (and `before` ones in control) until the first alarm.
// Lines that give an alarm before count for nothing where a shift is looked for.
RunLengths Simulate(
    int parameters, const ChartOptions& options, double shift, int before, int common = 5) {
  std::vector<double> runs;
  for (int line = 0; line < RunLines(); ++line) {
    const int start = options.baseline_units + before;
    for (int units = shift == 0.0 ? 1000 : 200;; units *= 4) {
      SimulatedLine simulated(parameters, static_cast<std::uint64_t>(1000 + line), common);
      const LineData data = simulated.Units(start + units, shift, start);
      const ChartReport report = ControlCharts(data, options);
      const auto& alarms = report.stations.front().alarms;
      if (alarms.empty()) continue;
      if (alarms.front().unit >= start) runs.push_back(alarms.front().unit - start + 1.0);
      break;
    }
  }
  return Summary(runs);
}

void Report(const char* what, const RunLengths& runs) {
  std::printf("@run-lengths | %s | %d | %.1f ± %.1f | %.0f |\n",
              what,
              runs.lines,
              runs.mean,
              runs.sigma,
              runs.median);
}

ChartOptions OneChart() {
  ChartOptions options;
  options.shares = Only(ChartKind::kEwma);
  options.most_points = 0;
  return options;
}

ChartOptions AllCharts() {
  ChartOptions options;
  options.most_points = 0;
  return options;
}

// The everyday sample may be off by its own 3 σ.
TEST(RunLength, OfOneChartInControlIsAsStated) {
  const RunLengths runs = Simulate(1, OneChart(), 0.0, 0);
  Report("one EWMA chart, in control", runs);
  EXPECT_GE(runs.mean + 3.0 * runs.sigma, 370.0);
}

TEST(RunLength, OfOneChartFindsAShiftOfOneSigmaWithin12Units) {
  for (const int before : {0, 100}) {
    const RunLengths runs = Simulate(1, OneChart(), 1.0, before);
    Report("one EWMA chart, 1 σ", runs);
    EXPECT_LE(runs.mean, 12.0 + 3.0 * runs.sigma) << before;
  }
}

TEST(RunLength, OfAllChartsOfAStationTogetherIsAtLeastAsStated) {
  const RunLengths runs = Simulate(kParameters, AllCharts(), 0.0, 0);
  Report("all charts of 33 parameters, in control", runs);
  EXPECT_GE(runs.mean + 3.0 * runs.sigma, 370.0);
}

// The least favourable case: every chart finds false alarms of its own.
TEST(RunLength, OfChartsOfIndependentParametersIsAtLeastAsStated) {
  const RunLengths runs = Simulate(kParameters, AllCharts(), 0.0, 0, 0);
  Report("all charts of 33 independent parameters, in control", runs);
  EXPECT_GE(runs.mean + 3.0 * runs.sigma, 370.0);
}

TEST(RunLength, OfAllChartsFindsAShiftOfOneSigmaWithin22Units) {
  for (const int before : {0, 100}) {
    const RunLengths runs = Simulate(kParameters, AllCharts(), 1.0, before);
    Report("all charts of 33 parameters, 1 σ in one", runs);
    EXPECT_LE(runs.mean, 22.0 + 3.0 * runs.sigma) << before;
  }
}

const Chart& ChartOf(const StationCharts& station, ChartKind kind, int parameter) {
  for (const Chart& chart : station.charts) {
    if (chart.kind == kind && chart.parameter == parameter) return chart;
  }
  ADD_FAILURE() << NameOf(kind) << " of " << parameter;
  static const Chart kNone;
  return kNone;
}

// Montgomery, Introduction to Statistical Quality Control, appendix VI; half of the last digit.
TEST(ChartLimits, AgreeWithTabledConstants) {
  EXPECT_NEAR(C4(2), 0.7979, 5e-5);
  EXPECT_NEAR(C4(5), 0.9400, 5e-5);
  EXPECT_NEAR(C4(25), 0.9896, 5e-5);
  const auto a3 = [](double n) { return 3.0 / (C4(n) * std::sqrt(n)); };
  const auto b4 = [](double n) { return 1.0 + 3.0 / C4(n) * std::sqrt(1.0 - C4(n) * C4(n)); };
  EXPECT_NEAR(a3(5), 1.427, 5e-4);
  EXPECT_NEAR(b4(5), 2.089, 5e-4);
  EXPECT_NEAR(2.0 - b4(10), 0.284, 5e-4);  // B3
}

// python3, scipy; 200 units, 3 σ:
//   stats.t.isf(stats.norm.sf(3),199)
//   p=33; n=200: 33*199/167*stats.f.isf(.001,33,167), 199*stats.beta.isf(.001,33/2,(200-33-1)/2)
TEST(ChartLimits, AllowForTheBaseline) {
  EXPECT_NEAR(PredictiveWidth(3.0, 199.0), 3.04571374174 / std::sqrt(1.0 + 1.0 / 200.0), 1e-9);
  EXPECT_NEAR(HotellingLimit(33, 0.001, 200, false), 83.7683910253, 1e-7);
  EXPECT_NEAR(HotellingLimit(33, 0.001, 200, true), 59.2254548845, 1e-7);
}

TEST(ControlCharts, AgreeWithTheirDefinition) {
  SimulatedLine simulated(3, 1);
  const LineData data = simulated.Units(400);
  const StationCharts station = ControlCharts(data).stations.front();
  EXPECT_EQ(station.units, 400);
  EXPECT_EQ(station.baseline_units, 200);
  EXPECT_EQ(station.charts.size(), 3U + 1U);
  // The first units after the baseline are held against it alone.
  double mean = 0.0;
  double squares = 0.0;
  for (int k = 0; k < 200; ++k) mean += data.units[static_cast<std::size_t>(k)].values[1] / 200.0;
  for (int k = 0; k < 200; ++k) {
    squares += std::pow(data.units[static_cast<std::size_t>(k)].values[1] - mean, 2);
  }
  const double sigma = std::sqrt(squares / 199.0);
  const auto deviation = [&](std::size_t unit) {
    return (data.units[unit].values[1] - mean) / sigma;
  };
  const Chart& ewma = ChartOf(station, ChartKind::kEwma, 1);
  ASSERT_EQ(ewma.points.size(), 200U);
  EXPECT_EQ(ewma.points[0].unit, 200);
  // 1e-9: of a value about 1 with a spread of 0.1.
  EXPECT_NEAR(ewma.points[1].value, 0.08 * deviation(201) + 0.92 * 0.08 * deviation(200), 1e-9);
  EXPECT_EQ(ChartOf(station, ChartKind::kHotelling, -1).points.size(), 200U);
}

TEST(ControlCharts, NameTheUnitAndTheParameterOfAnAlarm) {
  SimulatedLine simulated(6, 2);
  LineData data = simulated.Units(500);
  data.units[250].values[2] += 12.0 * SimulatedLine::ScaleOf(2);
  for (std::size_t unit = 350; unit < 450; ++unit) {
    data.units[unit].values[4] += 3.0 * SimulatedLine::ScaleOf(4);
  }
  const StationCharts station = ControlCharts(data).stations.front();
  const auto find = [&](ChartKind kind, int parameter, int first, int last) {
    return std::find_if(station.alarms.begin(), station.alarms.end(), [&](const ChartAlarm& alarm) {
      return alarm.kind == kind && alarm.parameter == parameter && alarm.unit >= first &&
             alarm.unit <= last;
    });
  };
  const auto together = find(ChartKind::kHotelling, -1, 250, 250);
  ASSERT_NE(together, station.alarms.end());
  EXPECT_EQ(together->most, 2);
  const auto shifted = find(ChartKind::kEwma, 4, 350, 360);
  ASSERT_NE(shifted, station.alarms.end());
  // One alarm as long as the level is away, and a while until the average has forgotten it.
  EXPECT_GE(shifted->last_unit, 449);
  EXPECT_LE(shifted->last_unit, 475);
}

// The shift of one parameter, 2 σ from unit 300 on, is its EWMA's alarm until the end; what all
// together are held against stays as it was before it.
TEST(ControlCharts, OfAllTogetherDoNotTakeAShiftForNormal) {
  SimulatedLine simulated(3, 16);
  const LineData data = simulated.Units(1000, 2.0, 300);
  const StationCharts station = ControlCharts(data).stations.front();
  const auto t2_of = [](const StationCharts& of) { return ChartOf(of, ChartKind::kHotelling, -1); };
  const auto mean = [](const std::vector<ChartPoint>& points) {
    double sum = 0.0;
    for (auto point = points.end() - 300; point < points.end(); ++point) sum += point->value;
    return sum / 300.0;
  };
  // 3 in control, and 4 more of the shift at least.
  EXPECT_GT(mean(t2_of(station).points), 6.0);
}

// A twentieth of the baseline is spoilt by 30 σ; it would take 6.6 times the σ otherwise.
TEST(ControlCharts, FindAShiftInSpiteOfOutliersInTheBaseline) {
  SimulatedLine simulated(1, 3);
  LineData data = simulated.Units(300, 2.0, 200);
  for (std::size_t unit = 0; unit < 200; unit += 20) data.units[unit].values[0] += 30.0;
  const StationCharts station = ControlCharts(data, OneChart()).stations.front();
  EXPECT_EQ(station.baseline_outliers.size(), 10U);
  ASSERT_EQ(station.alarms.size(), 1U);
  EXPECT_LE(station.alarms[0].unit, 210);
  EXPECT_EQ(station.alarms[0].last_unit, 299);
}

TEST(ControlCharts, JudgeFewUnitsByEachOther) {
  SimulatedLine simulated(2, 4);
  LineData data = simulated.Units(120, 2.0, 60);
  const StationCharts station = ControlCharts(data).stations.front();
  EXPECT_EQ(station.baseline_units, 120);
  const bool found =
      std::any_of(station.alarms.begin(), station.alarms.end(), [](const auto& alarm) {
        return alarm.kind == ChartKind::kEwma && alarm.parameter == 0;
      });
  EXPECT_TRUE(found);
}

TEST(ControlCharts, LeaveOutWhatIsFixedTiedOrUnknown) {
  SimulatedLine simulated(3, 5);
  LineData data = simulated.Units(300);
  data.parameters.insert(data.parameters.end(), {"fixed", "tied", "rare"});
  for (std::size_t k = 0; k < data.units.size(); ++k) {
    UnitRecord& unit = data.units[k];
    unit.values.conservativeResize(6);
    unit.values[3] = 1.0;
    unit.values[4] = 3.0 * unit.values[0] - unit.values[1];
    unit.values[5] = k < 15 ? static_cast<double>(k) : std::nan("");
  }
  for (std::size_t k = 5; k < 300; k += 50) data.units[k].values.setConstant(std::nan(""));
  data.units[6].values.resize(0);  // refused
  const StationCharts station = ControlCharts(data).stations.front();
  EXPECT_EQ(station.constant, std::vector<int>{3});
  EXPECT_EQ(station.dependent, std::vector<int>{4});
  EXPECT_EQ(station.sparse, std::vector<int>{5});
  EXPECT_EQ(ChartOf(station, ChartKind::kHotelling, -1).line, 3.0);
  EXPECT_EQ(station.note, "");
}

TEST(ControlCharts, AreOfEachStationAndKeepTheLastPoints) {
  SimulatedLine simulated(2, 6);
  LineData data = simulated.Units(1000);
  for (std::size_t k = 0; k < data.units.size(); ++k) {
    data.units[k].tags = {{"station", k % 2 == 0 ? "S1" : "S2"}};
  }
  ChartOptions options;
  options.most_points = 50;
  const ChartReport report = ControlCharts(data, options);
  ASSERT_EQ(report.stations.size(), 2U);
  EXPECT_EQ(report.stations[1].station, "S2");
  const Chart& ewma = ChartOf(report.stations[1], ChartKind::kEwma, 1);
  ASSERT_EQ(ewma.points.size(), 50U);
  EXPECT_EQ(ewma.points.back().unit, 999);
}

TEST(ControlCharts, OfNothingAreNone) {
  EXPECT_TRUE(ControlCharts(LineData{}).stations.empty());
  SimulatedLine simulated(2, 7);
  const ChartReport report = ControlCharts(simulated.Units(10));
  ASSERT_EQ(report.stations.size(), 1U);
  EXPECT_EQ(report.stations[0].note,
            "no charts: each parameter is constant or has values for fewer than 20 units");
}

// Alarms of a set of n units that judge each other are n / 370 on average, or fewer: over so many
// lines that `permitted` are, not more than that and 3.5 of their σ (Poisson's; alarms of one cause
// on several charts come together, hence twice the variance).
void ExpectFewAlarmsAmong(int parameters, int units, const ChartOptions& options, int permitted) {
  const int stations = static_cast<int>(std::lround(permitted * 370.0 / units));
  SimulatedLine simulated(parameters, 10, 0);
  LineData data = simulated.Units(stations * units);
  for (std::size_t k = 0; k < data.units.size(); ++k) {
    data.units[k].tags["station"] = std::to_string(k / static_cast<std::size_t>(units));
  }
  std::array<int, kChartKindCount> alarms{};
  const ChartReport report = ControlCharts(data, options);
  for (const StationCharts& station : report.stations) {
    for (const ChartAlarm& alarm : station.alarms) ++alarms[static_cast<std::size_t>(alarm.kind)];
  }
  std::printf("@phase-1 | %d | %d | %d |", parameters, units, stations);
  for (const int count : alarms) std::printf(" %d |", count);
  std::printf("\n");
  const int sum = std::accumulate(alarms.begin(), alarms.end(), 0);
  EXPECT_LE(sum, permitted + 3.5 * std::sqrt(2.0 * permitted)) << parameters << " x " << units;
}

TEST(ControlCharts, OfUnitsThatJudgeEachOtherGiveFewFalseAlarms) {
  for (const auto& [parameters, units] : {std::pair(2, 20), {5, 30}, {10, 30}, {33, 80}}) {
    ExpectFewAlarmsAmong(parameters, units, AllCharts(), 50);
  }
}

// Screening by each parameter leaves too few for a covariance of all.
TEST(ControlCharts, OfAllTogetherTakeEnoughUnitsThatAreNoOutliers) {
  SimulatedLine simulated(10, 8);
  LineData data = simulated.Units(24);
  for (Eigen::Index k = 0; k < 10; ++k) {
    data.units[static_cast<std::size_t>(k)].values[k] += 1e3 * SimulatedLine::ScaleOf(k);
  }
  const StationCharts station = ControlCharts(data).stations.front();
  EXPECT_EQ(station.note,
            "no chart of all parameters together: it needs 20 baseline units that are no outliers "
            "and have all 10 parameters; there are 14");
  EXPECT_EQ(station.charts.back().kind, ChartKind::kEwma);
}

// The level that the baseline ends with is 1.2 of 1.4 σ above its mean: 0.86 σ of it, which is 4.2
// of the average's.
TEST(ControlCharts, FindInLaterUnitsWhatShiftedWithinTheBaseline) {
  SimulatedLine simulated(5, 11);
  const StationCharts station =
      ControlCharts(simulated.Units(300, 2.0, 80), AllCharts()).stations.front();
  const bool is_found =
      std::any_of(station.alarms.begin(), station.alarms.end(), [](const ChartAlarm& alarm) {
        return alarm.kind == ChartKind::kEwma && alarm.parameter == 0 && alarm.last_unit == 299;
      });
  EXPECT_TRUE(is_found);
}

// A parameter that half of the units have is judged by its own units.
TEST(ControlCharts, OfAParameterThatFewUnitsHaveAreItsOwn) {
  SimulatedLine simulated(3, 14);
  LineData data = simulated.Units(300);
  for (std::size_t k = 0; k < 300; k += 2) data.units[k].values[1] = std::nan("");
  for (std::size_t k = 251; k < 300; k += 2)
    data.units[k].values[1] += 3.0 * SimulatedLine::ScaleOf(1);
  const StationCharts station = ControlCharts(data).stations.front();
  EXPECT_TRUE(station.sparse.empty());
  const bool found =
      std::any_of(station.alarms.begin(), station.alarms.end(), [](const ChartAlarm& alarm) {
        return alarm.kind == ChartKind::kEwma && alarm.parameter == 1 && alarm.unit >= 251 - 20;
      });
  EXPECT_TRUE(found);
  EXPECT_EQ(ChartOf(station, ChartKind::kHotelling, -1).line, 2.0);
}

// Weights 0.1, 0.09, 0.081 of which the second unit is not in the mean of 50.
TEST(ChartLimits, AllowForUnitsThatAreInTheMeanThemselves) {
  MovingWeights weights(0.1);
  weights.Add(true);
  weights.Add(false);
  weights.Add(true);
  const double squares = 0.1 * 0.1 + 0.09 * 0.09 + 0.081 * 0.081;
  EXPECT_NEAR(weights.Variance(50.0), squares + 0.271 * (0.271 - 2.0 * 0.181) / 50.0, 1e-15);
}

}  // namespace control_chart_test
}  // namespace truetriad::line
