// SPDX-License-Identifier: Apache-2.0
#include "line/control_chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "line/simulated_lines.h"
#include "support/nightly.h"

namespace truetriad::line {
namespace {

constexpr int kParameters = 33;

int RunLines() { return IsNightly() ? 500 : 30; }

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
RunLengths Simulate(int parameters, const ChartOptions& options, double shift, int before) {
  std::vector<double> runs;
  for (int line = 0; line < RunLines(); ++line) {
    const int start = options.baseline_units + before;
    for (int units = shift == 0.0 ? 2000 : 300;; units *= 4) {
      SimulatedLine simulated(parameters, static_cast<std::uint64_t>(1000 + line));
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

TEST(RunLength, OfAllChartsFindsAShiftOfOneSigmaWithin22Units) {
  for (const int before : {0, 100}) {
    const RunLengths runs = Simulate(kParameters, AllCharts(), 1.0, before);
    Report("all charts of 33 parameters, 1 σ in one", runs);
    EXPECT_LE(runs.mean, 22.0 + 3.0 * runs.sigma) << before;
  }
}

}  // namespace
}  // namespace truetriad::line
