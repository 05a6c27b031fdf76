// SPDX-License-Identifier: Apache-2.0
#include "line/control_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "line/baseline.h"
#include "line/baseline_shift.h"
#include "line/chart_plan.h"

namespace truetriad::line {
namespace {

constexpr std::size_t kLeastUnits{kLeastBaselineUnits};
// Probability that a baseline in control is said to shift within itself.
constexpr double kShiftLevel = 0.01;
constexpr double kSharedBy = 0.9;

std::vector<int> WatchedOf(const LineData& data, const ChartOptions& options) {
  std::vector<int> watched;
  for (std::size_t k = 0; k < data.parameters.size(); ++k) {
    const auto& wanted = options.parameters;
    if (wanted.empty() ||
        std::find(wanted.begin(), wanted.end(), data.parameters[k]) != wanted.end()) {
      watched.push_back(static_cast<int>(k));
    }
  }
  return watched;
}

double ValueOf(const UnitRecord& unit, int parameter) {
  return parameter < unit.values.size() ? unit.values[parameter]
                                        : std::numeric_limits<double>::quiet_NaN();
}

// Values of one parameter over a station's units.
ParameterValues ValuesOf(const LineData& data, const std::vector<int>& units, int parameter) {
  ParameterValues values;
  values.parameter = parameter;
  for (const int unit : units) {
    const double value = ValueOf(data.units[static_cast<std::size_t>(unit)], parameter);
    if (!std::isfinite(value)) continue;
    values.units.push_back(unit);
    values.values.push_back(value);
  }
  return values;
}

// The first `units` values; all of them (0, or no more are there): they judge each other.
void SetBaseline(int units, ParameterValues* values) {
  const std::size_t count = values->values.size();
  const auto wanted = static_cast<std::size_t>(std::max(units, 0));
  values->own = wanted == 0 || wanted >= count;
  values->baseline = values->own ? count : wanted;
  const auto end = values->values.begin() + static_cast<std::ptrdiff_t>(values->baseline);
  values->good = WithoutOutliers({values->values.begin(), end});
}

// Those that nine of ten units have: of fewer the other units would be lost for charts of all.
std::vector<ParameterValues> SharedOf(const std::vector<ParameterValues>& watched, int units) {
  std::vector<ParameterValues> shared;
  for (const ParameterValues& values : watched) {
    if (static_cast<double>(values.values.size()) >= kSharedBy * units) shared.push_back(values);
  }
  return shared;
}

// What shifts within its baseline has none: its units judge each other, as before it was full. All
// together do where one of them does.
void DropShiftedBaselines(const LineData& data,
                          std::vector<ParameterValues>* watched,
                          std::vector<ParameterValues>* shared,
                          StationCharts* station) {
  station->alarms = BaselineShifts(data, *watched, 0.5 * kShiftLevel);
  if (station->alarms.empty()) {
    const auto shift = JointBaselineShift(data, *shared, 0.5 * kShiftLevel);
    if (shift) station->alarms.push_back(*shift);
  }
  for (ChartAlarm& alarm : station->alarms) {
    for (ParameterValues& values : *watched) {
      if (alarm.parameter == values.parameter) SetBaseline(0, &values);
      alarm.last_unit = std::max(alarm.last_unit, values.units.back());
    }
  }
  const auto judge_each_other = [](const ParameterValues& values) { return values.own; };
  if (!station->alarms.empty() || std::any_of(shared->begin(), shared->end(), judge_each_other)) {
    for (ParameterValues& values : *shared) SetBaseline(0, &values);
  }
}

bool VariesInBaseline(const ParameterValues& values) {
  std::vector<double> good;
  for (std::size_t k = 0; k < values.baseline; ++k) {
    if (values.good[k]) good.push_back(values.values[k]);
  }
  return good.size() >= 2 && Varies(good);
}

void AddBaselineOutliers(const ParameterValues& values, std::vector<int>* outliers) {
  for (std::size_t k = 0; k < values.baseline; ++k) {
    if (!values.good[k]) outliers->push_back(values.units[k]);
  }
}

void SortUnique(std::vector<int>* numbers) {
  std::sort(numbers->begin(), numbers->end());
  numbers->erase(std::unique(numbers->begin(), numbers->end()), numbers->end());
}

// `plans`: of stations before, by their number of parameters.
StationCharts ChartsOf(const LineData& data,
                       const std::string& name,
                       const std::vector<int>& units,
                       const ChartOptions& options,
                       std::map<std::size_t, ChartPlan>* plans) {
  StationCharts station;
  station.station = name;
  std::vector<ParameterValues> watched;
  for (const int parameter : WatchedOf(data, options)) {
    watched.push_back(ValuesOf(data, units, parameter));
    station.units = std::max(station.units, static_cast<int>(watched.back().values.size()));
  }
  const bool own = options.baseline_units <= 0 || options.baseline_units >= station.units;
  station.baseline_units = own ? station.units : options.baseline_units;
  std::erase_if(watched, [&](ParameterValues& values) {
    const bool is_sparse = values.values.size() < kLeastUnits;
    if (is_sparse) station.sparse.push_back(values.parameter);
    if (is_sparse) return true;
    SetBaseline(options.baseline_units, &values);
    if (VariesInBaseline(values)) return false;
    AddBaselineOutliers(values, &station.baseline_outliers);
    station.constant.push_back(values.parameter);
    return true;
  });
  std::vector<ParameterValues> shared = SharedOf(watched, station.units);
  DropShiftedBaselines(data, &watched, &shared, &station);
  for (const ParameterValues& values : watched) {
    AddBaselineOutliers(values, &station.baseline_outliers);
  }
  SortUnique(&station.baseline_outliers);
  if (watched.empty()) {
    station.note = "no charts: no parameter that varies has " + std::to_string(kLeastUnits) +
                   " units with a value";
    return station;
  }
  const ChartPlan& plan = plans->try_emplace(watched.size(), options, watched.size()).first->second;
  if (plan.Has(ChartKind::kEwma)) {
    for (const ParameterValues& values : watched) DrawEwma(values, plan, &station);
  }
  if (plan.Has(ChartKind::kHotelling)) DrawHotelling(data, shared, plan, &station);
  std::stable_sort(station.charts.begin(),
                   station.charts.end(),
                   [](const Chart& a, const Chart& b) { return a.kind < b.kind; });
  std::stable_sort(station.alarms.begin(),
                   station.alarms.end(),
                   [](const ChartAlarm& a, const ChartAlarm& b) { return a.unit < b.unit; });
  return station;
}

}  // namespace

const char* NameOf(ChartKind kind) {
  static constexpr std::array<const char*, kChartKindCount + 1> kNames = {"ewma", "t2", "baseline"};
  return kNames[static_cast<std::size_t>(kind)];
}

ChartShares Only(ChartKind kind) {
  ChartShares shares{};
  shares[static_cast<std::size_t>(kind)] = 1.0;
  return shares;
}

ChartReport ControlCharts(const LineData& data, const ChartOptions& options) {
  std::map<std::string, std::vector<int>> units_of;
  for (std::size_t k = 0; k < data.units.size(); ++k) {
    units_of[TagOf(data.units[k], "station")].push_back(static_cast<int>(k));
  }
  ChartReport report;
  std::map<std::size_t, ChartPlan> plans;
  for (const auto& [station, units] : units_of) {
    report.stations.push_back(ChartsOf(data, station, units, options, &plans));
  }
  return report;
}

}  // namespace truetriad::line
