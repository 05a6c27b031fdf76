// SPDX-License-Identifier: Apache-2.0
#include "line/baseline_shift.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "math/dense/cholesky.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kLeastRun = 10;
// Where runs may begin and end; between more of them no shift is found that these do not show.
constexpr Index kMostPlaces = 300;

// Good units of a baseline with a value of every parameter, a column each, in their order.
struct BaselineUnits {
  std::vector<int> parameters, units;
  MatrixXd values;
};

// A run of units [first, last) that differs from the others.
struct Run {
  Index first = 0, last = 0;
  double t2 =
      0.0;  // in the covariance of all, for the variance of the run's mean about that of all

  double Units() const { return static_cast<double>(last - first); }
};

// T^2 at its largest over the runs that last to the end, and over the others; how many there are.
struct LargestRuns {
  Run to_end, within;
  double to_end_count = 0.0, within_count = 0.0;
};

LargestRuns FindLargest(const MatrixXd& white) {
  const Index count = white.cols();
  const Index places = std::min(count, kMostPlaces);
  MatrixXd sums = MatrixXd::Zero(white.rows(), count + 1);
  for (Index k = 0; k < count; ++k) sums.col(k + 1) = sums.col(k) + white.col(k);
  LargestRuns largest;
  // A run from the first unit on is one to the end, of the others.
  for (Index a = 1; a < places; ++a) {
    for (Index b = a + 1; b <= places; ++b) {
      Run run{a * count / places, b * count / places, 0.0};
      const Index units = run.last - run.first;
      if (units < kLeastRun || count - units < kLeastRun) continue;
      const double n = run.Units();
      const double variance = 1.0 / n - 1.0 / static_cast<double>(count);
      run.t2 = (sums.col(run.last) - sums.col(run.first)).squaredNorm() / (n * n) / variance;
      const bool is_to_end = b == places;
      (is_to_end ? largest.to_end_count : largest.within_count) += 1.0;
      Run& most = is_to_end ? largest.to_end : largest.within;
      if (run.t2 > most.t2) most = run;
    }
  }
  return largest;
}

// Difference between a run and the others, in σ within both, that gives this T^2.
double ShiftOf(const Run& run, double t2, double count) {
  const double n = run.Units();
  const double mean = std::sqrt(t2 * (1.0 / n - 1.0 / count)) * count / (count - n);
  const double within = (1.0 - t2 / (count - 1.0)) * (count - 1.0) / (count - 2.0);
  return mean / std::sqrt(std::max(within, 0.0));
}

std::optional<ChartAlarm> ShiftIn(const BaselineUnits& units, double level) {
  const Index count = units.values.cols();
  const auto dimension = static_cast<int>(units.values.rows());
  if (count < 2 * kLeastRun || count < 2 * units.values.rows()) return std::nullopt;
  const MatrixXd deviations = units.values.colwise() - VectorXd(units.values.rowwise().mean());
  RunningScatter scatter(units.values.rows());
  for (Index k = 0; k < count; ++k) scatter.Add(deviations.col(k));
  const Cholesky root(scatter.Covariance());
  if (!root.is_positive()) return std::nullopt;
  const LargestRuns largest = FindLargest(root.SolveLower(deviations));
  const double n = static_cast<double>(count);
  const auto limit_of = [&](double runs) {
    return HotellingLimit(dimension, 0.5 * level / std::max(runs, 1.0), n, true);
  };
  const double to_end = limit_of(largest.to_end_count), within = limit_of(largest.within_count);
  const bool lasts = largest.to_end.t2 / to_end >= largest.within.t2 / within;
  const Run& run = lasts ? largest.to_end : largest.within;
  const double limit = lasts ? to_end : within;
  if (!(run.t2 > limit)) return std::nullopt;
  ChartAlarm alarm;
  alarm.kind = ChartKind::kBaseline;
  alarm.unit = units.units[static_cast<std::size_t>(run.first)];
  alarm.value = ShiftOf(run, run.t2, n);
  alarm.limit = ShiftOf(run, limit, n);
  const VectorXd moved = deviations.middleCols(run.first, run.last - run.first)
                             .rowwise()
                             .mean()
                             .cwiseQuotient(scatter.Covariance().diagonal().cwiseSqrt());
  Index most = 0;
  moved.cwiseAbs().maxCoeff(&most);
  if (dimension == 1) {
    alarm.parameter = units.parameters.front();
    if (moved[0] < 0.0) {
      alarm.value = -alarm.value;
      alarm.limit = -alarm.limit;
    }
  } else {
    alarm.most = units.parameters[static_cast<std::size_t>(most)];
  }
  return alarm;
}

BaselineUnits GoodUnits(const LineData& data, const std::vector<const ParameterValues*>& some) {
  BaselineUnits good;
  std::set<int> bad;
  for (const ParameterValues* values : some) {
    good.parameters.push_back(values->parameter);
    for (std::size_t k = 0; k < values->baseline; ++k) {
      if (!values->good[k]) bad.insert(values->units[k]);
    }
  }
  const ParameterValues& first = *some.front();
  std::vector<VectorXd> columns;
  for (std::size_t k = 0; k < first.baseline; ++k) {
    const int unit = first.units[k];
    if (bad.contains(unit)) continue;
    VectorXd column(static_cast<Index>(some.size()));
    for (std::size_t c = 0; c < some.size(); ++c) {
      column[static_cast<Index>(c)] =
          data.units[static_cast<std::size_t>(unit)].values[some[c]->parameter];
    }
    if (!column.allFinite()) continue;
    good.units.push_back(unit);
    columns.push_back(std::move(column));
  }
  good.values.resize(static_cast<Index>(some.size()), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    good.values.col(static_cast<Index>(k)) = columns[k];
  }
  return good;
}

// Those that others do not determine.
std::vector<const ParameterValues*> IndependentParameters(
    const LineData& data, const std::vector<const ParameterValues*>& some) {
  const BaselineUnits units = GoodUnits(data, some);
  std::vector<const ParameterValues*> kept;
  if (units.values.cols() < 2) return kept;
  RunningScatter scatter(units.values.rows());
  for (Index k = 0; k < units.values.cols(); ++k) scatter.Add(units.values.col(k));
  for (const Index place : IndependentColumns(scatter.Covariance())) {
    kept.push_back(some[static_cast<std::size_t>(place)]);
  }
  return kept;
}

}  // namespace

std::vector<ChartAlarm> BaselineShifts(const LineData& data,
                                       const std::vector<ParameterValues>& watched,
                                       double level) {
  std::vector<ChartAlarm> shifts;
  for (const ParameterValues& values : watched) {
    if (values.own) continue;
    const double level_of_one = level / static_cast<double>(watched.size());
    if (auto shift = ShiftIn(GoodUnits(data, {&values}), level_of_one)) shifts.push_back(*shift);
  }
  return shifts;
}

std::optional<ChartAlarm> JointBaselineShift(const LineData& data,
                                             const std::vector<ParameterValues>& shared,
                                             double level) {
  std::vector<const ParameterValues*> all;
  for (const ParameterValues& values : shared) {
    if (values.own) return std::nullopt;
    all.push_back(&values);
  }
  if (all.size() > 1) all = IndependentParameters(data, all);
  return all.size() > 1 ? ShiftIn(GoodUnits(data, all), level) : std::nullopt;
}

}  // namespace truetriad::line
