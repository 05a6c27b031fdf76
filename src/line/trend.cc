// SPDX-License-Identifier: Apache-2.0
#include "line/trend.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "line/moment.h"
#include "line/multiple_tests.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

constexpr std::size_t kLeastTrendUnits = 10;
// Pairs of groups are what it costs: 45,000 a parameter.
constexpr std::size_t kMostGroups = 300;
constexpr double kSecondsOfDay = 86400.0;
// Autocorrelations of ranks count where they exceed this many σ of independent ones (5 %).
constexpr double kSignificant = 1.96;
// Of the value before; with more a series cannot be told from one that wanders.
constexpr double kMostInherited = 0.99;

struct Series {
  std::vector<double> x, y;
};

// Medians of consecutive groups of a series that is sorted by x.
Series Grouped(const Series& series) {
  const std::size_t count = series.x.size();
  const std::size_t groups = std::min(count, kMostGroups);
  Series grouped;
  for (std::size_t g = 0; g < groups; ++g) {
    const auto first = static_cast<std::ptrdiff_t>(g * count / groups);
    const auto last = static_cast<std::ptrdiff_t>((g + 1) * count / groups);
    grouped.x.push_back(Median({series.x.begin() + first, series.x.begin() + last}));
    grouped.y.push_back(Median({series.y.begin() + first, series.y.begin() + last}));
  }
  return grouped;
}

// Ranks from 1, ties with their mean; how many values each set of ties has.
std::vector<double> RanksOf(const std::vector<double>& values, std::vector<double>* ties) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return values[a] < values[b];
  });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last + 1 < order.size() && values[order[last + 1]] == values[order[first]]) ++last;
    for (std::size_t k = first; k <= last; ++k) {
      ranks[order[k]] = 0.5 * static_cast<double>(first + last) + 1.0;
    }
    ties->push_back(static_cast<double>(last - first + 1));
    first = last + 1;
  }
  return ranks;
}

// Slopes of all pairs, and Kendall's S.
struct Pairs {
  std::vector<double> slopes;
  double s = 0.0;
};

Pairs PairsOf(const Series& series) {
  Pairs pairs;
  for (std::size_t a = 0; a < series.x.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double dx = series.x[a] - series.x[b];
      if (dx == 0.0) continue;
      const double slope = (series.y[a] - series.y[b]) / dx;
      pairs.slopes.push_back(slope);
      pairs.s += slope > 0.0 ? 1.0 : slope < 0.0 ? -1.0 : 0.0;
    }
  }
  return pairs;
}

// Of S without trend, for independent values with ties in x and in y (Kendall 1970, eq. 4.4).
double VarianceOfS(const Series& series) {
  struct Terms {
    double pairs = 0.0, triples = 0.0, all = 0.0;
    void Add(double n) {
      pairs += n * (n - 1.0);
      triples += n * (n - 1.0) * (n - 2.0);
      all += n * (n - 1.0) * (2.0 * n + 5.0);
    }
  };
  const auto of_ties = [](const std::vector<double>& values) {
    std::vector<double> ties;
    RanksOf(values, &ties);
    Terms terms;
    for (const double tie : ties) terms.Add(tie);
    return terms;
  };
  const Terms x = of_ties(series.x);
  const Terms y = of_ties(series.y);
  Terms whole;
  whole.Add(static_cast<double>(series.x.size()));
  return (whole.all - x.all - y.all) / 18.0 + x.triples * y.triples / (9.0 * whole.triples) +
         x.pairs * y.pairs / (2.0 * whole.pairs);
}

// Hamed and Rao 1998, eq. 10, from autocorrelations of the ranks of what the trend leaves. Those
// that are too small to be told from 0 are missing in it, so at least that of a series in which
// each value inherits a part of the one before. Never below 1, which chance alone would make of
// half of the series.
double InflationOf(const Series& series, double slope) {
  const std::size_t count = series.x.size();
  std::vector<double> rest(count);
  for (std::size_t k = 0; k < count; ++k) rest[k] = series.y[k] - slope * series.x[k];
  std::vector<double> ties;
  std::vector<double> ranks = RanksOf(rest, &ties);
  const double n = static_cast<double>(count);
  double squares = 0.0;
  for (double& rank : ranks) {
    rank -= 0.5 * (n + 1.0);
    squares += rank * rank;
  }
  if (!(squares > 0.0)) return 1.0;
  double sum = 0.0;
  double inherited = 1.0;
  for (std::size_t lag = 1; lag <= count / 4; ++lag) {
    double products = 0.0;
    for (std::size_t k = lag; k < count; ++k) products += ranks[k] * ranks[k - lag];
    const double correlation = products / squares;
    if (std::abs(correlation) < kSignificant / std::sqrt(n)) continue;
    if (lag == 1) {
      // Kendall 1954: it is estimated too small.
      const double part = std::min(correlation + (1.0 + 3.0 * correlation) / n, kMostInherited);
      inherited = (1.0 + part) / (1.0 - part);
    }
    const double left = n - static_cast<double>(lag);
    sum += left * (left - 1.0) * (left - 2.0) * correlation;
  }
  return std::max({1.0 + 2.0 * sum / (n * (n - 1.0) * (n - 2.0)), inherited, 1.0});
}

double Quantile(std::vector<double>* values, double place) {
  const double last = static_cast<double>(values->size() - 1);
  const auto at = values->begin() + static_cast<std::ptrdiff_t>(std::clamp(place, 0.0, last));
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

// Unset: too few values, or all at one x.
std::optional<Trend> TrendOf(const Series& all, int parameter) {
  if (all.x.size() < kLeastTrendUnits || all.x.front() == all.x.back()) return std::nullopt;
  const Series series = Grouped(all);
  Pairs pairs = PairsOf(series);
  const double variance = VarianceOfS(series);
  if (pairs.slopes.empty() || !(variance > 0.0)) return std::nullopt;
  Trend trend;
  trend.parameter = parameter;
  trend.units = static_cast<int>(all.x.size());
  trend.slope = Median(pairs.slopes);
  trend.inflation = InflationOf(series, trend.slope);
  const double sigma = std::sqrt(variance * trend.inflation);
  const double size = std::max(std::abs(pairs.s) - 1.0, 0.0);
  trend.p = 2.0 * NormalCdf(-size / sigma);
  // Sen 1968: the slopes that S would have to move to for one σ of its own.
  const double middle = 0.5 * static_cast<double>(pairs.slopes.size());
  const double upper = Quantile(&pairs.slopes, middle + 0.5 * sigma);
  trend.sigma = 0.5 * (upper - Quantile(&pairs.slopes, middle - 0.5 * sigma));
  std::vector<double> rest(series.x.size());
  for (std::size_t k = 0; k < rest.size(); ++k) {
    rest[k] = series.y[k] - trend.slope * (series.x[k] - all.x.front());
  }
  trend.intercept = Median(std::move(rest));
  trend.change = trend.slope * (all.x.back() - all.x.front());
  return trend;
}

// What stations differ by is none of the trend, though their part in the units may change: each
// station's median is moved to that of all. `stations`: of each value.
void MoveTogether(const std::vector<std::string>& stations, std::vector<double>* values) {
  std::map<std::string, std::vector<double>> values_of;
  for (std::size_t k = 0; k < values->size(); ++k) values_of[stations[k]].push_back((*values)[k]);
  if (values_of.size() < 2) return;
  const double middle = Median(*values);
  std::map<std::string, double> offset_of;
  for (const auto& [station, own] : values_of) offset_of[station] = Median(own) - middle;
  for (std::size_t k = 0; k < values->size(); ++k) (*values)[k] -= offset_of[stations[k]];
}

// Trends of all parameters against x of each unit; NaN: not known.
std::vector<Trend> TrendsAgainst(const LineData& data, const std::vector<double>& x) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isfinite(x[k])) order.push_back(k);
  }
  std::stable_sort(
      order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  std::vector<Trend> trends;
  std::vector<double> p;
  for (std::size_t parameter = 0; parameter < data.parameters.size(); ++parameter) {
    const auto place = static_cast<Eigen::Index>(parameter);
    Series series;
    std::vector<std::string> stations;
    for (const std::size_t unit : order) {
      const Eigen::VectorXd& values = data.units[unit].values;
      if (place >= values.size() || !std::isfinite(values[place])) continue;
      series.x.push_back(x[unit]);
      series.y.push_back(values[place]);
      stations.push_back(TagOf(data.units[unit], "station"));
    }
    MoveTogether(stations, &series.y);
    if (const auto trend = TrendOf(series, static_cast<int>(parameter))) {
      trends.push_back(*trend);
      p.push_back(trend->p);
    }
  }
  const std::vector<double> adjusted = HolmAdjusted(p);
  for (std::size_t k = 0; k < trends.size(); ++k) trends[k].p_adjusted = adjusted[k];
  return trends;
}

// Spearman's correlation of what is known of both; NaN: none.
double RankCorrelation(const std::vector<double>& x, const std::vector<double>& y) {
  Series known;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) continue;
    known.x.push_back(x[k]);
    known.y.push_back(y[k]);
  }
  std::vector<double> ties;
  const std::vector<double> first = RanksOf(known.x, &ties), second = RanksOf(known.y, &ties);
  const double mean = 0.5 * (static_cast<double>(first.size()) + 1.0);
  double products = 0.0, first_squares = 0.0, second_squares = 0.0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    products += (first[k] - mean) * (second[k] - mean);
    first_squares += std::pow(first[k] - mean, 2);
    second_squares += std::pow(second[k] - mean, 2);
  }
  return products / std::sqrt(first_squares * second_squares);
}

double NumberOf(const std::string& text) {
  double number = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  const bool is_number = error == std::errc() && stop == end && !text.empty();
  return is_number ? number : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

TrendReport Trends(const LineData& data, const TrendOptions& options) {
  TrendReport report;
  if (data.units.empty()) return report;
  report.first = data.units.front().created;
  report.last = data.units.back().created;
  std::vector<double> days, places, temperatures;
  for (const UnitRecord& unit : data.units) {
    days.push_back(SecondsOf(unit.created) / kSecondsOfDay);
    places.push_back(static_cast<double>(places.size()));
    temperatures.push_back(NumberOf(TagOf(unit, options.temperature_tag)));
  }
  const auto [least, most] = std::minmax_element(days.begin(), days.end());
  report.by_time =
      std::all_of(days.begin(), days.end(), [](double day) { return std::isfinite(day); }) &&
      *most > *least;
  const std::vector<double>& times = report.by_time ? days : places;
  report.time = TrendsAgainst(data, times);
  report.temperature_with_time = RankCorrelation(temperatures, times);
  report.temperature = TrendsAgainst(data, temperatures);
  return report;
}

}  // namespace truetriad::line
