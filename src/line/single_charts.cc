// SPDX-License-Identifier: Apache-2.0
//
// Charts of one parameter's single values: EWMA, individuals and moving range.
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <tuple>
#include <vector>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "line/chart_plan.h"

namespace truetriad::line {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::quiet_NaN();
// An alarm of the EWMA ends below this share of its limit: it is a level, not a unit.
constexpr double kQuiet = 0.5;
// σ from differences of neighbours has 2/3 of the degrees of freedom of that about the mean.
constexpr double kDofOfDifferences = 2.0 / 3.0;

// What is normal, as of now.
struct Normal {
  Known known;
  double centre = 0.0, sigma = 0.0;
  double single = 0.0, range = 0.0;  // limits, in σ
  double left_out = 0.0;             // that of single units that are not in the estimate
  double ewma = 0.0;                 // limit over the EWMA's own σ
};

class Singles {
 public:
  Singles(const ParameterValues& values, const ChartPlan& plan)
      : values_(values),
        plan_(plan),
        first_(values.own ? 0 : values.baseline),
        usable_(values.values.size(), true),
        weights_(plan.options.ewma_lambda),
        ewma_(WriterOf(ChartKind::kEwma)),
        single_(WriterOf(ChartKind::kIndividuals)),
        range_(WriterOf(ChartKind::kMovingRange)) {
    for (std::size_t k = 0; k < values.baseline; ++k) {
      if (values.good[k]) moments_.Add(values.values[k]);
    }
    SetLimits();
  }

  void Draw() {
    for (std::size_t k = first_; k < values_.values.size(); ++k) {
      if (!values_.own) Follow(k);
      const bool far = AddSingle(k);
      if (range_ && k > 0) AddRange(k);
      const bool shifted = ewma_ && AddAverage(k);
      usable_[k] = !far && !shifted;
    }
  }

  void MoveTo(StationCharts* station) {
    for (const auto& [writer, kind, line] :
         {std::tuple(&ewma_, ChartKind::kEwma, 0.0),
          std::tuple(&single_, ChartKind::kIndividuals, 0.0),
          std::tuple(&range_, ChartKind::kMovingRange, 2.0 / std::sqrt(std::numbers::pi))}) {
      if (!*writer) continue;
      Chart& chart = (*writer)->chart;
      chart.line = line;
      chart.run_length = 1.0 / plan_.RateOf(kind);
      chart.centre = normal_.centre;
      chart.sigma = normal_.sigma / C4(normal_.known.dof + 1.0);
      (*writer)->MoveTo(station);
    }
  }

 private:
  std::optional<ChartWriter> WriterOf(ChartKind kind) const {
    if (!plan_.Has(kind)) return std::nullopt;
    const std::size_t skipped = kind == ChartKind::kMovingRange && first_ == 0 ? 1 : first_;
    return ChartWriter(
        kind, values_.parameter, values_.values.size() - skipped, plan_.options.most_points);
  }

  void SetLimits() {
    normal_.centre = moments_.mean;
    normal_.known = {moments_.count, moments_.count - 1.0, values_.own};
    normal_.sigma = std::sqrt(moments_.Variance());
    // A shift amid units that judge each other widens their σ about the mean, but not that of
    // neighbours.
    if (values_.own) SetSigmaOfNeighbours();
    if (plan_.single_width > 0.0) {
      normal_.single = PredictiveLimit(plan_.single_width, 1.0, 1.0, normal_.known);
      Known later = normal_.known;
      later.own = false;
      normal_.left_out = PredictiveLimit(plan_.single_width, 1.0, 1.0, later);
    }
    if (plan_.range_width > 0.0) {
      normal_.range = PredictiveLimit(plan_.range_width, 2.0, 0.0, normal_.known);
    }
    if (ewma_) normal_.ewma = PredictiveLimit(plan_.ewma_width, 1.0, 0.0, normal_.known);
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
    normal_.sigma = std::sqrt(0.5 * squares / pairs);
    normal_.known.dof = kDofOfDifferences * pairs;
  }

  void Follow(std::size_t k) {
    if (k < first_ + kBaselineLag) return;
    const std::size_t joining = k - kBaselineLag;
    if (!usable_[joining]) return;
    moments_.Add(values_.values[joining]);
    if (moments_.count >= kBaselineGrowth * normal_.known.count) SetLimits();
  }

  // Whether the unit is one of those that mean and σ are from.
  bool IsOwn(std::size_t k) const { return values_.own && values_.good[k]; }

  // Whether it is far from the others, too far to be one of the baseline.
  bool AddSingle(std::size_t k) {
    const double value = (values_.values[k] - normal_.centre) / normal_.sigma;
    const double size = std::abs(value);
    if (!single_) return size > kFarAway;
    const double limit = IsOwn(k) ? normal_.single : normal_.left_out;
    single_->Add({values_.units[k], value, -limit, limit}, size > limit);
    return size > std::min(limit, kFarAway);
  }

  void AddRange(std::size_t k) {
    const double value = std::abs(values_.values[k] - values_.values[k - 1]) / normal_.sigma;
    range_->Add({values_.units[k], value, kNoLimit, normal_.range}, value > normal_.range);
  }

  // Whether the level is out of control.
  bool AddAverage(std::size_t k) {
    const double lambda = plan_.options.ewma_lambda;
    average_ += lambda * (values_.values[k] - normal_.centre - average_);
    weights_.Add(IsOwn(k));
    const double value = average_ / normal_.sigma;
    const double limit = normal_.ewma * std::sqrt(weights_.Variance(normal_.known.count));
    const bool before = ewma_->in_alarm();
    const bool alarm = std::abs(value) > (before ? kQuiet * limit : limit);
    ewma_->Add({values_.units[k], value, -limit, limit}, alarm);
    if (alarm && !before) LeaveOutPending(k);
    if (before && !alarm) {  // as after a repair: the chart begins anew
      average_ = 0.0;
      weights_.Restart();
    }
    return alarm;
  }

  void LeaveOutPending(std::size_t k) {
    for (std::size_t at = k - std::min(k, kBaselineLag); at < k; ++at) usable_[at] = false;
  }

  // Of normal values one in 16,000 is left out of the baseline though it belongs there.
  static constexpr double kFarAway = 4.0;

  const ParameterValues& values_;
  const ChartPlan& plan_;
  std::size_t first_;
  std::vector<bool> usable_;  // for the baseline
  RunningMoments moments_;
  Normal normal_;
  double average_ = 0.0;  // EWMA of deviations, in the parameter's unit
  MovingWeights weights_;
  std::optional<ChartWriter> ewma_, single_, range_;
};

}  // namespace

void DrawSingles(const ParameterValues& values, const ChartPlan& plan, StationCharts* station) {
  Singles singles(values, plan);
  singles.Draw();
  singles.MoveTo(station);
}

}  // namespace truetriad::line
