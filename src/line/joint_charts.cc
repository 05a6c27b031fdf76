// SPDX-License-Identifier: Apache-2.0
//
// Charts of all parameters together: T^2 of single units and the multivariate EWMA.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "line/chart_plan.h"
#include "math/dense/cholesky.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoLowerLimit = std::numeric_limits<double>::quiet_NaN();
// Baseline units for each parameter, at least: with n = 2 p limits are twice those of a known
// covariance already.
constexpr std::size_t kLeastUnitsOfParameter = 2;
// One of so many normal units is left out of the baseline though it belongs there.
constexpr double kFarAwayProbability = 1e-4;
constexpr int kMostScreens = 5;
// A moving average is one of the estimate's own units if these have so much of its weight.
constexpr double kOwnWeight = 0.99;

// Units with values of all parameters, as columns scaled by their spread in the baseline.
struct TogetherUnits {
  std::vector<int> parameters;
  std::vector<int> units;
  std::vector<VectorXd> values;
  std::size_t baseline = 0;
  std::vector<bool> good;  // of the baseline

  bool AreEnough(double count) const {
    return count >= static_cast<double>(kLeastUnitsOfParameter * parameters.size());
  }
};

class Together {
 public:
  Together(TogetherUnits units, bool own, ChartPlan* plan)
      : units_(std::move(units)),
        own_(own),
        plan_(*plan),
        dimension_(static_cast<Index>(units_.parameters.size())),
        scatter_(dimension_),
        usable_(units_.values.size(), true),
        weights_(plan->options.mewma_lambda),
        average_(VectorXd::Zero(dimension_)) {
    Screen();
    if (!HasEnough()) return;
    if (plan->Has(ChartKind::kMewma)) {
      mewma_limit_ = plan->MewmaLimitOf(static_cast<int>(dimension_));
    }
    SetLimits();
  }

  // Whether there are charts: units of the baseline that are left when it has been screened.
  bool HasEnough() const { return units_.AreEnough(scatter_.count); }
  double Count() const { return scatter_.count; }

  void DrawTo(StationCharts* station) {
    const std::size_t first = own_ ? 0 : units_.baseline;
    const std::size_t count = units_.values.size() - first;
    std::optional<ChartWriter> single, mewma;
    const int most = plan_.options.most_points;
    if (plan_.Has(ChartKind::kHotelling)) single.emplace(ChartKind::kHotelling, -1, count, most);
    if (plan_.Has(ChartKind::kMewma)) mewma.emplace(ChartKind::kMewma, -1, count, most);
    for (std::size_t k = first; k < units_.values.size(); ++k) {
      if (!own_) Follow(k);
      const VectorXd deviation = units_.values[k] - scatter_centre_;
      const bool far = AddSingle(k, deviation, single ? &*single : nullptr);
      const bool shifted = mewma && AddAverage(k, deviation, &*mewma);
      usable_[k] = !far && !shifted;
    }
    for (std::optional<ChartWriter>* writer : {&single, &mewma}) {
      if (!*writer) continue;
      Chart& chart = (*writer)->chart;
      chart.line = static_cast<double>(dimension_);
      chart.run_length = 1.0 / plan_.RateOf(chart.kind);
      (*writer)->MoveTo(station);
    }
  }

 private:
  // The baseline without units that are far from the others in all parameters together.
  void Screen() {
    for (int round = 0;; ++round) {
      scatter_ = RunningScatter(dimension_);
      for (std::size_t k = 0; k < units_.baseline; ++k) {
        if (units_.good[k]) scatter_.Add(units_.values[k]);
      }
      if (round == kMostScreens || !HasEnough()) break;
      SetCentre();
      const double limit =
          (1.0 - 1.0 / scatter_.count) *
          HotellingLimit(static_cast<int>(dimension_), kFarAwayProbability, scatter_.count, true);
      bool same = true;
      for (std::size_t k = 0; k < units_.baseline; ++k) {
        if (!units_.good[k]) continue;
        units_.good[k] =
            root_.SolveLowerVector(units_.values[k] - scatter_centre_).squaredNorm() <= limit;
        same = same && units_.good[k];
      }
      if (same) break;
    }
  }

  void SetCentre() {
    scatter_centre_ = scatter_.mean;
    root_ = Cholesky(scatter_.Covariance());
    count_ = scatter_.count;
  }

  void SetLimits() {
    SetCentre();
    const int p = static_cast<int>(dimension_);
    const double rate = plan_.RateOf(ChartKind::kHotelling);
    for (const bool own : {false, true}) {
      Limits& limits = own ? own_limits_ : later_limits_;
      limits.far = HotellingLimit(p, kFarAwayProbability, count_, own);
      if (rate > 0.0) limits.single = HotellingLimit(p, rate, count_, own);
      if (mewma_limit_ > 0.0) {
        limits.average = HotellingLimit(p, 1.0 - ChiSquareCdf(mewma_limit_, p), count_, own);
      }
    }
  }

  void Follow(std::size_t k) {
    if (k < units_.baseline + kBaselineLag) return;
    const std::size_t joining = k - kBaselineLag;
    if (!usable_[joining]) return;
    scatter_.Add(units_.values[joining]);
    if (scatter_.count >= kBaselineGrowth * count_) SetLimits();
  }

  // Whether the unit is one of those that centre and covariance are from.
  bool IsOwn(std::size_t k) const { return own_ && units_.good[k]; }

  // Of units of a station, that parameter that the others let expect least.
  int MostOf(const VectorXd& deviation) const {
    const MatrixXd inverse = root_.Inverse();
    const VectorXd pull = inverse * deviation;
    Index most = 0;
    (pull.cwiseAbs2().cwiseQuotient(inverse.diagonal())).maxCoeff(&most);
    return units_.parameters[static_cast<std::size_t>(most)];
  }

  void Add(std::size_t k,
           double value,
           double limit,
           bool alarm,
           const VectorXd& deviation,
           ChartWriter* writer) const {
    const bool before = writer->in_alarm();
    writer->Add({units_.units[k], value, kNoLowerLimit, limit}, alarm);
    if (alarm && !before) writer->SetMost(MostOf(deviation));
  }

  bool AddSingle(std::size_t k, const VectorXd& deviation, ChartWriter* writer) const {
    MovingWeights weights(1.0);
    weights.Add(IsOwn(k));
    const Limits& limits = IsOwn(k) ? own_limits_ : later_limits_;
    const double value = root_.SolveLowerVector(deviation).squaredNorm() / weights.Variance(count_);
    if (writer != nullptr) {
      Add(k, value, limits.single, value > limits.single, deviation, writer);
    }
    return value > limits.far;
  }

  bool AddAverage(std::size_t k, const VectorXd& deviation, ChartWriter* writer) {
    const double lambda = plan_.options.mewma_lambda;
    average_ += lambda * (deviation - average_);
    weights_.Add(IsOwn(k));
    // Of later units that of the final state, and what the centre adds, as the run length has it.
    const double variance =
        own_ ? weights_.Variance(count_) : lambda / (2.0 - lambda) + 1.0 / count_;
    const double limit =
        weights_.OwnShare() >= kOwnWeight ? own_limits_.average : later_limits_.average;
    const double value = root_.SolveLowerVector(average_).squaredNorm() / variance;
    const bool before = writer->in_alarm();
    // An alarm ends where the chart is back at its average in control.
    const bool alarm = value > (before ? static_cast<double>(dimension_) : limit);
    Add(k, value, limit, alarm, average_, writer);
    if (alarm && !before) {
      for (std::size_t at = k - std::min(k, kBaselineLag); at < k; ++at) usable_[at] = false;
    }
    if (before && !alarm) {
      average_.setZero();
      weights_.Restart();
    }
    return alarm;
  }

  struct Limits {
    double single = 0.0, far = 0.0, average = 0.0;
  };

  TogetherUnits units_;
  bool own_;
  const ChartPlan& plan_;
  Index dimension_;
  RunningScatter scatter_;
  std::vector<bool> usable_;  // for the baseline
  // As of the last SetLimits:
  VectorXd scatter_centre_;
  Cholesky root_;
  double count_ = 0.0;
  Limits own_limits_, later_limits_;  // of the estimate's own units, and of others

  double mewma_limit_ = 0.0;  // of a known covariance
  MovingWeights weights_;
  VectorXd average_;
};

// Units of the station with a value of every parameter.
TogetherUnits CompleteUnits(const LineData& data,
                            const std::vector<const ParameterValues*>& parameters) {
  TogetherUnits together;
  std::set<int> baseline, bad;
  std::vector<double> scale;
  for (const ParameterValues* values : parameters) {
    together.parameters.push_back(values->parameter);
    RunningMoments moments;
    for (std::size_t k = 0; k < values->baseline; ++k) {
      baseline.insert(values->units[k]);
      if (!values->good[k]) bad.insert(values->units[k]);
      if (values->good[k]) moments.Add(values->values[k]);
    }
    scale.push_back(1.0 / std::sqrt(moments.Variance()));
  }
  const Index dimension = static_cast<Index>(parameters.size());
  for (const int unit : parameters.front()->units) {
    VectorXd row(dimension);
    for (Index k = 0; k < dimension; ++k) {
      const auto place = static_cast<std::size_t>(k);
      row[k] = scale[place] *
               data.units[static_cast<std::size_t>(unit)].values[together.parameters[place]];
    }
    if (!row.allFinite()) continue;
    if (baseline.contains(unit)) {
      ++together.baseline;
      together.good.push_back(!bad.contains(unit));
    }
    together.units.push_back(unit);
    together.values.push_back(std::move(row));
  }
  return together;
}

// Without what the others determine.
std::vector<const ParameterValues*> IndependentOf(
    const TogetherUnits& together,
    const std::vector<const ParameterValues*>& parameters,
    StationCharts* station) {
  RunningScatter scatter(static_cast<Index>(parameters.size()));
  for (std::size_t k = 0; k < together.baseline; ++k) {
    if (together.good[k]) scatter.Add(together.values[k]);
  }
  std::vector<const ParameterValues*> kept;
  if (scatter.count < 2.0) return kept;
  const std::vector<Index> independent = IndependentColumns(scatter.Covariance());
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const bool is_kept =
        std::binary_search(independent.begin(), independent.end(), static_cast<Index>(k));
    if (is_kept) {
      kept.push_back(parameters[k]);
    } else {
      station->dependent.push_back(parameters[k]->parameter);
    }
  }
  return kept;
}

void NoteTooFew(std::ptrdiff_t good, std::size_t parameters, StationCharts* station) {
  AddNote("no charts of all parameters together: it takes " +
              std::to_string(kLeastUnitsOfParameter * parameters) +
              " baseline units that are no outliers with all " + std::to_string(parameters) +
              " parameters, and there are " + std::to_string(good),
          station);
}

}  // namespace

void DrawTogether(const LineData& data,
                  const std::vector<ParameterValues>& shared,
                  ChartPlan* plan,
                  StationCharts* station) {
  std::vector<const ParameterValues*> parameters;
  for (const ParameterValues& values : shared) parameters.push_back(&values);
  if (parameters.size() < 2) return;
  TogetherUnits together = CompleteUnits(data, parameters);
  const auto good = std::count(together.good.begin(), together.good.end(), true);
  if (!together.AreEnough(static_cast<double>(good))) {
    NoteTooFew(good, parameters.size(), station);
    return;
  }
  const std::vector<const ParameterValues*> kept = IndependentOf(together, parameters, station);
  if (kept.size() < 2) return;
  if (kept.size() < parameters.size()) together = CompleteUnits(data, kept);
  Together charts(std::move(together), parameters.front()->own, plan);
  if (charts.HasEnough()) {
    charts.DrawTo(station);
  } else {
    NoteTooFew(std::lround(charts.Count()), kept.size(), station);
  }
}

}  // namespace truetriad::line
