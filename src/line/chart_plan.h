// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "line/control_chart.h"

namespace truetriad::line {

// Parts of ControlCharts.

/// The false alarms that each chart of a station may give, and the limits that follow.
struct ChartPlan {
  /// `charts`: parameters that have charts of their own.
  ChartPlan(const ChartOptions& options, std::size_t charts);

  bool Has(ChartKind kind) const { return RateOf(kind) > 0.0; }
  /// False alarms a unit of one chart of this kind.
  double RateOf(ChartKind kind) const { return rates[static_cast<std::size_t>(kind)]; }

  ChartOptions options;
  std::array<double, kChartKindCount> rates{};
  double ewma_width = 0.0;  // In σ of a known process; 0 without such charts.
};

/// One parameter's values at one station.
struct ParameterValues {
  int parameter = 0;
  std::vector<int> units;      // with a value, in their order; indices in LineData::units
  std::vector<double> values;  // of these
  std::size_t baseline = 0;    // the first so many are the baseline
  bool own = false;            // that is all of them: phase I
  std::vector<bool> good;      // of the baseline: no outlier
};

/// The baseline follows so many units behind the line. A shift of 1 σ is found in a fifth of that;
/// one that was in the baseline already would hide itself (see docs/line.md).
inline constexpr std::size_t kBaselineLag = 100;
/// Limits are computed anew when the baseline has grown by this factor.
inline constexpr double kBaselineGrowth = 1.05;

/// A chart as its points come.
class ChartWriter {
 public:
  /// `count` points will come, of which the last `most` are kept.
  ChartWriter(ChartKind kind, int parameter, std::size_t count, int most);

  /// An alarm lasts from a point with `alarm` to the last one that follows without interruption.
  void Add(const ChartPoint& point, bool alarm);
  bool in_alarm() const { return in_alarm_; }
  /// The alarm that has just begun is mostly of this parameter.
  void SetMost(int parameter) { alarms_.back().most = parameter; }

  void MoveTo(StationCharts* station);
  Chart chart;

 private:
  std::size_t skipped_;  // points before those that are kept
  bool in_alarm_ = false;
  std::vector<ChartAlarm> alarms_;
};

/// Another sentence of station->note.
void AddNote(const std::string& sentence, StationCharts* station);

/// The EWMA of one parameter.
void DrawEwma(const ParameterValues& values, const ChartPlan& plan, StationCharts* station);

/// T^2 over those parameters, which all have a baseline or none; adds to station->dependent and
/// note. Units of the EWMA alarms that the station has by now are in no baseline.
void DrawHotelling(const LineData& data,
                   const std::vector<ParameterValues>& shared,
                   const ChartPlan& plan,
                   StationCharts* station);

}  // namespace truetriad::line
