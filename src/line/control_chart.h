// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "line/line_data.h"

namespace truetriad::line {

/// What a control chart plots.
enum class ChartKind {
  kEwma,       // exponentially weighted moving average of single units, a chart a parameter
  kHotelling,  // T^2 of single units over all parameters, one chart
};
inline constexpr std::array kChartKinds = {ChartKind::kEwma, ChartKind::kHotelling};
inline constexpr std::size_t kChartKindCount = kChartKinds.size();

/// As files and pages call it: "ewma", "t2".
const char* NameOf(ChartKind kind);

/// Parts of the permitted false alarms, by kind; a kind with 0 is not drawn. The sum is at most 1.
using ChartShares = std::array<double, kChartKindCount>;

/// Most of it for the EWMA charts, which find a lasting shift of 1 σ soonest; T^2 is for single
/// units, which exceed its limit by far. With a sum of 1 the run length of 33 independent
/// parameters was 354 ± 16 units where 370 are permitted (498 lines), so a tenth is kept back.
inline constexpr ChartShares kDefaultShares = {0.70, 0.20};
/// One kind alone.
ChartShares Only(ChartKind kind);

/// A parameter with fewer values has no charts.
inline constexpr int kLeastBaselineUnits = 20;

struct ChartOptions {
  /// Units between two false alarms, on average, over all charts of a station together.
  double run_length_units = 370.0;
  /// The units that say what is normal: the first so many of a station, followed by each later one
  /// that is in control (phase II). 0: all units judge each other (phase I).
  int baseline_units = 200;
  double ewma_lambda = 0.08;
  ChartShares shares = kDefaultShares;
  /// Points of a chart that are kept for display, the last ones; alarms are all kept.
  int most_points = 2000;
};

struct ChartPoint {
  int unit = 0;  // index in LineData::units
  double value = 0.0;
  double lower = 0.0, upper = 0.0;  // limits; NaN where there is none on that side
};

/// A false or true alarm: from the first unit outside the limits until the chart is quiet again.
struct ChartAlarm {
  ChartKind kind = ChartKind::kEwma;
  int parameter = -1;  // index in LineData::parameters; -1: of all together
  int unit = 0;        // index in LineData::units: where it begins
  int last_unit = 0;   // the last one of the alarm; that of the data if it lasts
  double value = 0.0;  // of the chart, where it begins
  double limit = 0.0;  // that it exceeds
  /// Of all together: the parameter that contributes most to it.
  int most = -1;
};

/// One chart, in σ of the process: value in the parameter's unit = centre + σ × that of the chart.
/// T^2 is without unit.
struct Chart {
  ChartKind kind = ChartKind::kEwma;
  int parameter = -1;
  double line = 0.0;        // where the chart's values stand on average while in control
  double run_length = 0.0;  // units between false alarms of this chart alone, on average
  double centre = 0.0;      // of the process, at the last unit; parameter's unit
  double sigma = 0.0;       // of single units
  std::vector<ChartPoint> points;
};

/// All charts of one station.
struct StationCharts {
  std::string station;                 // the tag's value; empty: units without it
  int units = 0;                       // with a value of at least one parameter
  int baseline_units = 0;              // of them; all: they judge each other
  std::vector<int> baseline_outliers;  // units of the baseline that do not count
  std::vector<int> constant;           // parameters that never vary there: no chart
  std::vector<int> sparse;             // parameters with too few values for charts
  std::vector<int> dependent;          // that others determine: not in T^2
  std::vector<Chart> charts;           // by kind, then by parameter
  std::vector<ChartAlarm> alarms;      // in the order of units
  std::string note;                    // why there are fewer charts than asked for; empty: none
};

struct ChartReport {
  std::vector<StationCharts> stations;  // by name
};

/// Control charts of each station's parameters over its units in their order.
///
/// Limits are those of a process with known mean and covariance that share the permitted false
/// alarms (see chart_plan.h), widened for mean and covariance being estimated from n units: a limit
/// is exceeded as often, over all baselines, as if they were known. The baseline follows the line
/// 100 units behind, and leaves out what looks out of control. See docs/line.md.
///
/// Units without a value are left out of that parameter's charts. Options outside their range
/// (shares that are negative or sum to more than 1, λ outside 0.01...1) are CHECKed.
ChartReport ControlCharts(const LineData& data, const ChartOptions& options = {});

}  // namespace truetriad::line
