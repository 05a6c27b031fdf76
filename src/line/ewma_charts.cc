// SPDX-License-Identifier: Apache-2.0
//
// The EWMA chart of one parameter.
#include <algorithm>
#include <cmath>
#include <vector>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "line/chart_plan.h"

namespace truetriad::line {
namespace {

// An alarm of the EWMA ends below this share of its limit: it is a level, not a unit.
constexpr double kQuiet = 0.5;
// σ from differences of neighbours has 2/3 of the degrees of freedom of that about the mean.
constexpr double kDofOfDifferences = 2.0 / 3.0;
// In σ: of normal values one in 16,000 is left out of the baseline though it belongs there.
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
    // A shift amid units that judge each other widens their σ about the mean, but not that of
    // neighbours.
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

  // Whether the level is out of control.
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
    if (before && !alarm) {  // as after a repair: the chart begins anew
      average_ = 0.0;
      weights_.Restart();
    }
    return alarm;
  }

  const ParameterValues& values_;
  const ChartPlan& plan_;
  std::size_t first_;
  std::vector<bool> usable_;  // for the baseline
  RunningMoments moments_;
  // What is normal, as of the last SetLimits; count and dof: units in the mean, and of σ.
  double centre_ = 0.0, sigma_ = 0.0, count_ = 0.0, dof_ = 0.0;
  double limit_ = 0.0;    // over the EWMA's own σ
  double average_ = 0.0;  // EWMA of deviations, in the parameter's unit
  MovingWeights weights_;
  ChartWriter writer_;
};

}  // namespace

void DrawEwma(const ParameterValues& values, const ChartPlan& plan, StationCharts* station) {
  Ewma(values, plan).DrawTo(station);
}

}  // namespace truetriad::line
