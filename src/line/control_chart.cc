// SPDX-License-Identifier: Apache-2.0
#include "line/control_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "line/chart_plan.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

// First round: values within this many robust σ of the median are kept. The number is large, since
// outliers inflate the robust σ.
constexpr double kFirstReach = 5.0;
constexpr double kReach = 4.0;  // Later rounds: σ from the mean; excludes 1 normal value in 16,000
constexpr int kMostRounds = 10;  // Ends a search that alternates between two sets.
// Differences below this share of a value's magnitude are rounding errors.
constexpr double kSame = 1e-12;

// An EWMA alarm ends below this share of the limit, so that a level near the limit gives one alarm.
constexpr double kQuiet = 0.5;
// σ from differences of neighbours has 2/3 of the degrees of freedom of σ about the mean.
constexpr double kDofOfDifferences = 2.0 / 3.0;
// Values farther than this many σ from the mean do not join the baseline: 1 of 16,000 normal
// values.
constexpr double kFarAway = 4.0;

class Ewma {
 public:
  Ewma(const ParameterValues& values, const ChartPlan& plan)
      : values_(values),
        plan_(plan),
        first_(values.own ? 0 : values.baseline),
        usable_(values.values.size(), true),
        weights_(plan.options.ewma_lambda),
        writer_(ChartKind::kEwma,
                values.parameter,
                values.values.size() - first_,
                plan.options.most_points) {
    for (std::size_t k = 0; k < values.baseline; ++k) {
      if (values.good[k]) moments_.Add(values.values[k]);
    }
    SetLimits();
  }

  void DrawTo(StationCharts* station) {
    for (std::size_t k = first_; k < values_.values.size(); ++k) {
      if (!values_.own) Follow(k);
      const bool is_far = std::abs(values_.values[k] - centre_) > kFarAway * sigma_;
      const bool is_shifted = Add(k);
      usable_[k] = !is_far && !is_shifted;
    }
    writer_.chart.run_length = 1.0 / plan_.RateOf(ChartKind::kEwma);
    writer_.chart.centre = centre_;
    writer_.chart.sigma = sigma_ / C4(dof_ + 1.0);
    writer_.MoveTo(station);
  }

 private:
  void SetLimits() {
    centre_ = moments_.mean;
    count_ = moments_.count;
    dof_ = count_ - 1.0;
    sigma_ = std::sqrt(moments_.Variance());
    // In phase I a shift widens σ about the mean, but hardly σ of the differences of neighbours.
    if (values_.own) SetSigmaOfNeighbours();
    limit_ = PredictiveWidth(plan_.ewma_width, dof_);
  }

  void SetSigmaOfNeighbours() {
    double squares = 0.0;
    double pairs = 0.0;
    for (std::size_t k = 1; k < values_.values.size(); ++k) {
      if (!values_.good[k] || !values_.good[k - 1]) continue;
      squares += std::pow(values_.values[k] - values_.values[k - 1], 2);
      pairs += 1.0;
    }
    if (pairs < 2.0 || !(squares > 0.0)) return;
    sigma_ = std::sqrt(0.5 * squares / pairs);
    dof_ = kDofOfDifferences * pairs;
  }

  void Follow(std::size_t k) {
    if (k < first_ + kBaselineLag) return;
    const std::size_t joining = k - kBaselineLag;
    if (!usable_[joining]) return;
    moments_.Add(values_.values[joining]);
    if (moments_.count >= kBaselineGrowth * count_) SetLimits();
  }

  // Adds a unit to the chart and returns whether the level is out of control.
  bool Add(std::size_t k) {
    average_ += plan_.options.ewma_lambda * (values_.values[k] - centre_ - average_);
    weights_.Add(values_.own && values_.good[k]);
    const double value = average_ / sigma_;
    const double limit = limit_ * std::sqrt(weights_.Variance(count_));
    const bool before = writer_.in_alarm();
    const bool alarm = std::abs(value) > (before ? kQuiet * limit : limit);
    writer_.Add({values_.units[k], value, -limit, limit}, alarm);
    if (alarm && !before) {
      for (std::size_t at = k - std::min(k, kBaselineLag); at < k; ++at) usable_[at] = false;
    }
    if (before && !alarm) {  // the chart restarts, as after a repair
      average_ = 0.0;
      weights_.Restart();
    }
    return alarm;
  }

  const ParameterValues& values_;
  const ChartPlan& plan_;
  std::size_t first_;
  std::vector<bool> usable_;  // for each value: whether it may join the baseline
  RunningMoments moments_;
  // As of the last SetLimits: mean and σ of the process, number of units in the mean, dof of σ.
  double centre_ = 0.0, sigma_ = 0.0, count_ = 0.0, dof_ = 0.0;
  double limit_ = 0.0;    // of the EWMA, in σ of the EWMA
  double average_ = 0.0;  // EWMA of deviations, in the parameter's unit
  MovingWeights weights_;
  ChartWriter writer_;
};

// Marks the values that are no outliers: first those within 5 robust σ of the median, then those
// within 4 σ of the mean of the marked ones, until the set stays the same. One normal value in
// 16,000 is left out; up to a third of all values may be outliers.
std::vector<bool> WithoutOutliers(const std::vector<double>& values) {
  std::vector<bool> good(values.size(), true);
  if (values.empty()) return good;
  double centre = Median(values);
  std::vector<double> deviations(values.size());
  std::transform(values.begin(), values.end(), deviations.begin(), [&](double value) {
    return value - centre;
  });
  double reach = kFirstReach * MadSigma(std::move(deviations));
  if (reach == 0.0) return good;
  for (int round = 0; round < kMostRounds; ++round) {
    RunningMoments moments;
    bool same = true;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool within = std::abs(values[k] - centre) <= reach;
      same = same && within == good[k];
      good[k] = within;
      if (within) moments.Add(values[k]);
    }
    if (round > 0 && same) break;
    centre = moments.mean;
    reach = kReach * std::sqrt(moments.Variance());
  }
  return good;
}

constexpr std::size_t kLeastUnits{kLeastBaselineUnits};
constexpr double kSharedBy = 0.9;  // Up to a tenth of the units may lack a parameter of T^2.

// Values of one parameter over a station's units.
ParameterValues ValuesOf(const LineData& data, const std::vector<int>& units, int parameter) {
  ParameterValues values;
  values.parameter = parameter;
  for (const int unit : units) {
    const Eigen::VectorXd& own = data.units[static_cast<std::size_t>(unit)].values;
    if (parameter >= own.size() || !std::isfinite(own[parameter])) continue;
    values.units.push_back(unit);
    values.values.push_back(own[parameter]);
  }
  return values;
}

// Makes the first `units` values the baseline. If `units` is 0 or there are no more values, all
// values are the baseline (phase I).
void SetBaseline(int units, ParameterValues* values) {
  const std::size_t count = values->values.size();
  const auto wanted = static_cast<std::size_t>(std::max(units, 0));
  values->own = wanted == 0 || wanted >= count;
  values->baseline = values->own ? count : wanted;
  const auto end = values->values.begin() + static_cast<std::ptrdiff_t>(values->baseline);
  values->good = WithoutOutliers({values->values.begin(), end});
}

// The parameters of T^2. T^2 leaves out units that lack one of them, so only parameters that nine
// of ten units have are chosen. If one of them has no separate baseline, no parameter gets one
// (phase I).
std::vector<ParameterValues> SharedOf(const std::vector<ParameterValues>& watched, int units) {
  std::vector<ParameterValues> shared;
  bool judge_each_other = false;
  for (const ParameterValues& values : watched) {
    if (static_cast<double>(values.values.size()) < kSharedBy * units) continue;
    shared.push_back(values);
    judge_each_other = judge_each_other || values.own;
  }
  if (!judge_each_other) return shared;
  for (ParameterValues& values : shared) SetBaseline(0, &values);
  return shared;
}

// Whether the values of the baseline vary by more than rounding.
bool VariesInBaseline(const ParameterValues& values) {
  std::vector<double> good;
  for (std::size_t k = 0; k < values.baseline; ++k) {
    if (values.good[k]) good.push_back(values.values[k]);
  }
  if (good.empty()) return false;
  const auto [least, most] = std::minmax_element(good.begin(), good.end());
  return *most - *least > kSame * std::max(std::abs(*least), std::abs(*most));
}

// Charts of one station. `plans` caches plans by number of parameters for the stations that follow.
StationCharts ChartsOf(const LineData& data,
                       const std::string& name,
                       const std::vector<int>& units,
                       const ChartOptions& options,
                       std::map<std::size_t, ChartPlan>* plans) {
  StationCharts station;
  station.station = name;
  std::vector<ParameterValues> watched;
  for (std::size_t k = 0; k < data.parameters.size(); ++k) {
    watched.push_back(ValuesOf(data, units, static_cast<int>(k)));
    station.units = std::max(station.units, static_cast<int>(watched.back().values.size()));
  }
  const bool own = options.baseline_units <= 0 || options.baseline_units >= station.units;
  station.baseline_units = own ? station.units : options.baseline_units;
  std::set<int> outliers;
  std::erase_if(watched, [&](ParameterValues& values) {
    const bool is_sparse = values.values.size() < kLeastUnits;
    if (is_sparse) station.sparse.push_back(values.parameter);
    if (is_sparse) return true;
    SetBaseline(options.baseline_units, &values);
    for (std::size_t k = 0; k < values.baseline; ++k) {
      if (!values.good[k]) outliers.insert(values.units[k]);
    }
    const bool is_constant = !VariesInBaseline(values);
    if (is_constant) station.constant.push_back(values.parameter);
    return is_constant;
  });
  station.baseline_outliers.assign(outliers.begin(), outliers.end());
  if (watched.empty()) {
    station.note = "no charts: each parameter is constant or has values for fewer than " +
                   std::to_string(kLeastUnits) + " units";
    return station;
  }
  const ChartPlan& plan = plans->try_emplace(watched.size(), options, watched.size()).first->second;
  if (plan.Has(ChartKind::kEwma)) {
    for (const ParameterValues& values : watched) Ewma(values, plan).DrawTo(&station);
  }
  if (plan.Has(ChartKind::kHotelling)) {
    DrawHotelling(data, SharedOf(watched, station.units), plan, &station);
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
  static constexpr std::array<const char*, kChartKindCount> kNames = {"ewma", "t2"};
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
