// SPDX-License-Identifier: Apache-2.0
#include "line/control_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "line/baseline.h"
#include "line/chart_plan.h"

namespace truetriad::line {
namespace {

// Fewer values have no charts.
constexpr std::size_t kLeastUnits = 20;

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

void NumberSubgroups(const LineData& data, const ChartOptions& options, ParameterValues* values) {
  const std::size_t count = values->values.size();
  const auto size = static_cast<std::size_t>(options.subgroup_units);
  const std::string* last = nullptr;
  int number = -1;
  for (std::size_t k = 0; k < count; ++k) {
    if (options.subgroup_tag.empty()) {
      // The last ones wait for the others of their subgroup.
      const std::size_t group = k / size;
      values->subgroups.push_back(group < count / size ? static_cast<int>(group) : -1);
      continue;
    }
    const std::string& tag =
        TagOf(data.units[static_cast<std::size_t>(values->units[k])], options.subgroup_tag);
    if (last == nullptr || tag != *last) ++number;
    last = &tag;
    values->subgroups.push_back(number);
  }
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

// False: there are too few.
bool SetBaseline(const ChartOptions& options, bool own, ParameterValues* values) {
  const std::size_t count = values->values.size();
  values->own = own;
  values->baseline = own ? count : static_cast<std::size_t>(options.baseline_units);
  if (count < kLeastUnits || (!own && count <= values->baseline)) return false;
  const auto end = values->values.begin() + static_cast<std::ptrdiff_t>(values->baseline);
  values->good = WithoutOutliers({values->values.begin(), end});
  return true;
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
    if (!SetBaseline(options, own, &values)) {
      station.sparse.push_back(values.parameter);
      return true;
    }
    AddBaselineOutliers(values, &station.baseline_outliers);
    if (VariesInBaseline(values)) return false;
    station.constant.push_back(values.parameter);
    return true;
  });
  SortUnique(&station.baseline_outliers);
  if (watched.empty()) {
    station.note = "no charts: no parameter that varies has " + std::to_string(kLeastUnits) +
                   " units with a value";
    return station;
  }
  ChartPlan& plan = plans->try_emplace(watched.size(), options, watched.size()).first->second;
  for (ParameterValues& values : watched) {
    DrawSingles(values, plan, &station);
    if (plan.Has(ChartKind::kXBar) || plan.Has(ChartKind::kS)) {
      NumberSubgroups(data, options, &values);
      DrawSubgroups(values, plan, &station);
    }
  }
  if (plan.Has(ChartKind::kHotelling) || plan.Has(ChartKind::kMewma)) {
    DrawTogether(data, watched, &plan, &station);
  }
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
  static constexpr std::array<const char*, kChartKindCount> kNames = {
      "ewma", "individuals", "moving-range", "x-bar", "s", "t2", "mewma"};
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
