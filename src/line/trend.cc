// SPDX-License-Identifier: Apache-2.0
#include "line/trend.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "line/baseline.h"
#include "line/moment.h"
#include "line/multiple_tests.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

constexpr std::size_t kLeastTrendUnits = 10;
// An autocorrelation counts where it exceeds this many σ of that of independent units (5 %).
constexpr double kSignificant = 1.96;
// Of the unit before; with more a series cannot be told from one that wanders.
constexpr double kMostInherited = 0.99;

// One parameter's units by time: x runs from 0 to 1 over the span of all units.
struct Series {
  std::vector<double> x, y;
  std::vector<std::string> stations;
};

// What stations differ by is none of the trend, though their part in the units may change: each
// station's median is moved to that of all.
void MoveTogether(Series* series) {
  std::map<std::string, std::vector<double>> values_of;
  for (std::size_t k = 0; k < series->y.size(); ++k) {
    values_of[series->stations[k]].push_back(series->y[k]);
  }
  if (values_of.size() < 2) return;
  const double middle = Median(series->y);
  std::map<std::string, double> offset_of;
  for (const auto& [station, own] : values_of) offset_of[station] = Median(own) - middle;
  for (std::size_t k = 0; k < series->y.size(); ++k) {
    series->y[k] -= offset_of[series->stations[k]];
  }
}

// (1 + ρ) / (1 - ρ) of what the line leaves; ρ is estimated too small by (2 + 4 ρ) / n about a
// line (Shaman & Stine 1988).
double InflationOf(const std::vector<double>& rest, double squares) {
  const auto n = static_cast<double>(rest.size());
  double products = 0.0;
  for (std::size_t k = 1; k < rest.size(); ++k) products += rest[k] * rest[k - 1];
  const double found = products / squares;
  if (!(found > kSignificant / std::sqrt(n))) return 1.0;
  const double inherited = std::min(found + (2.0 + 4.0 * found) / n, kMostInherited);
  return (1.0 + inherited) / (1.0 - inherited);
}

// Unset: too few units, or all at one moment, or without spread.
std::optional<Trend> TrendOf(Series all, int parameter) {
  MoveTogether(&all);
  const std::vector<bool> good = WithoutOutliers(all.y);
  Series series;
  RunningMoments x, y;
  for (std::size_t k = 0; k < all.x.size(); ++k) {
    if (!good[k]) continue;
    series.x.push_back(all.x[k]);
    series.y.push_back(all.y[k]);
    x.Add(all.x[k]);
    y.Add(all.y[k]);
  }
  const std::size_t count = series.x.size();
  if (count < kLeastTrendUnits || !(x.squares > 0.0) || !Varies(series.y)) return std::nullopt;
  Trend trend{.parameter = parameter, .units = static_cast<int>(count)};
  for (std::size_t k = 0; k < count; ++k) {
    trend.change += (series.x[k] - x.mean) * (series.y[k] - y.mean) / x.squares;
  }
  std::vector<double> rest(count);
  double squares = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    rest[k] = series.y[k] - y.mean - trend.change * (series.x[k] - x.mean);
    squares += rest[k] * rest[k];
  }
  if (!(squares > 0.0)) return std::nullopt;
  trend.inflation = InflationOf(rest, squares);
  const double dof = static_cast<double>(count) - 2.0;
  trend.sigma = std::sqrt(trend.inflation * squares / dof / x.squares);
  const double independent = std::max(static_cast<double>(count) / trend.inflation - 2.0, 1.0);
  trend.p = FisherUpper(std::pow(trend.change / trend.sigma, 2), 1.0, independent);
  return trend;
}

Series SeriesOf(const LineData& data,
                const std::vector<std::pair<double, std::size_t>>& by_time,
                Eigen::Index parameter) {
  const double first = by_time.front().first, span = by_time.back().first - first;
  Series series;
  for (const auto& [seconds, unit] : by_time) {
    const Eigen::VectorXd& values = data.units[unit].values;
    if (parameter >= values.size() || !std::isfinite(values[parameter])) continue;
    series.x.push_back((seconds - first) / span);
    series.y.push_back(values[parameter]);
    series.stations.push_back(TagOf(data.units[unit], "station"));
  }
  return series;
}

}  // namespace

TrendReport Trends(const LineData& data) {
  TrendReport report;
  std::vector<std::pair<double, std::size_t>> by_time;
  for (std::size_t k = 0; k < data.units.size(); ++k) {
    const double seconds = SecondsOf(data.units[k].recorded);
    if (std::isfinite(seconds)) by_time.emplace_back(seconds, k);
  }
  if (by_time.empty()) {
    report.note =
        data.units.empty() ? "no unit has a calibration" : "no unit's time of measurement is known";
    return report;
  }
  std::sort(by_time.begin(), by_time.end());  // Units of one moment stay in their order.
  report.first = data.units[by_time.front().second].recorded;
  report.last = data.units[by_time.back().second].recorded;
  if (by_time.front().first == by_time.back().first) {
    report.note = "all units were measured at the same moment, " + report.first;
    return report;
  }
  if (by_time.size() < data.units.size()) {
    report.note = std::to_string(data.units.size() - by_time.size()) + " of " +
                  std::to_string(data.units.size()) +
                  " units have no part in trends: their time of measurement is not known";
  }
  std::vector<double> p;
  for (Eigen::Index parameter = 0; parameter < std::ssize(data.parameters); ++parameter) {
    if (const auto trend =
            TrendOf(SeriesOf(data, by_time, parameter), static_cast<int>(parameter))) {
      report.trends.push_back(*trend);
      p.push_back(trend->p);
    }
  }
  const std::vector<double> adjusted = HolmAdjusted(p);
  for (std::size_t k = 0; k < p.size(); ++k) report.trends[k].p_adjusted = adjusted[k];
  return report;
}

}  // namespace truetriad::line
