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
  kEwma,       // exponentially weighted moving average of single units, one chart per parameter
  kHotelling,  // T^2 of single units over all parameters, one chart
};
inline constexpr std::array kChartKinds = {ChartKind::kEwma, ChartKind::kHotelling};
inline constexpr std::size_t kChartKindCount = kChartKinds.size();

/// The name in files and on pages: "ewma", "t2".
const char* NameOf(ChartKind kind);

/// Each kind's share of the permitted false alarms; a share of 0: not drawn. The sum is at most 1.
using ChartShares = std::array<double, kChartKindCount>;

/// EWMA charts find a lasting shift of 1 σ soonest and get the largest share; T^2 finds single
/// units that are far off. A tenth is kept in reserve: when the shares summed to 1, the run length
/// of 33 independent parameters was 354 ± 16 units (498 lines) instead of 370.
inline constexpr ChartShares kDefaultShares = {0.70, 0.20};
/// The shares in which only `kind` is drawn.
ChartShares Only(ChartKind kind);

/// A parameter with fewer values has no charts: 20 values give σ to 1 / sqrt(2 · 19) = 16 %.
inline constexpr int kLeastBaselineUnits = 20;

struct ChartOptions {
  /// Average number of units between two false alarms of all charts of a station together.
  double run_length_units = 370.0;
  /// This many first units of a station define the process in control, the baseline. Later units in
  /// control join it (phase II). 0: all units are the baseline (phase I).
  int baseline_units = 200;
  double ewma_lambda = 0.08;
  ChartShares shares = kDefaultShares;
  /// Only this many last points of a chart are kept for display; all alarms are kept.
  int most_points = 2000;
};

struct ChartPoint {
  int unit = 0;  // index in LineData::units
  double value = 0.0;
  double lower = 0.0, upper = 0.0;  // limits; NaN: none on that side
};

/// An alarm, false or true, from the first unit outside the limits until the chart is quiet again.
struct ChartAlarm {
  ChartKind kind = ChartKind::kEwma;
  int parameter = -1;  // index in LineData::parameters; -1: T^2 of all parameters
  int unit = 0;        // index in LineData::units of the alarm's first unit
  int last_unit = 0;   // index of the alarm's last unit, as far as the data reach
  double value = 0.0;  // value of the chart at the first unit
  double limit = 0.0;  // the limit that `value` exceeds
  /// For T^2: index of the parameter that contributes most.
  int most = -1;
};

/// One chart. Values of an EWMA are in σ of the process: in the parameter's unit an EWMA is centre
/// + σ × value of the chart. T^2 has no unit.
struct Chart {
  ChartKind kind = ChartKind::kEwma;
  int parameter = -1;
  double line = 0.0;        // mean of the chart's values if in control
  double run_length = 0.0;  // units between false alarms of this chart alone, on average
  double centre = 0.0;      // process mean as of the last unit, in the parameter's unit
  double sigma = 0.0;       // process σ of single units as of the last unit, in that unit
  std::vector<ChartPoint> points;
};

/// All charts of one station.
struct StationCharts {
  std::string station;                 // value of the tag `station`; empty: units without the tag
  int units = 0;                       // units that have the parameter that most units have
  int baseline_units = 0;              // units in the baseline; equal to `units`: phase I
  std::vector<int> baseline_outliers;  // units excluded from the baseline
  std::vector<int> constant;           // parameters without variation: no chart
  std::vector<int> sparse;             // parameters with too few values for charts
  std::vector<int> dependent;          // parameters that others determine: not in T^2
  std::vector<Chart> charts;           // by kind, then by parameter
  std::vector<ChartAlarm> alarms;      // in the order of units
  std::string note;                    // why all charts or T^2 are missing; may be empty
};

struct ChartReport {
  std::vector<StationCharts> stations;  // by name
};

/// Control charts of each station's parameters over the station's units in their order.
///
/// The charts share the permitted false alarms (see chart_plan.h). Limits for a known process are
/// widened, because mean and covariance are estimated from n units: on average over all baselines,
/// a limit is exceeded as often as if both were known. The baseline lags the line by 100 units and
/// excludes units out of control. See docs/line.md.
///
/// A unit without a value of a parameter is left out of that parameter's charts. Options outside
/// their range (shares that are negative or sum to more than 1, λ outside 0.01...1) are CHECKed.
ChartReport ControlCharts(const LineData& data, const ChartOptions& options = {});

}  // namespace truetriad::line
