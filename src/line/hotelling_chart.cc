// SPDX-License-Identifier: Apache-2.0
//
// The chart of all parameters together: T^2 of single units.
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "line/chart_plan.h"
#include "math/dense/cholesky.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoLowerLimit = std::numeric_limits<double>::quiet_NaN();
// Least number of baseline units per parameter: with n = 2 p units for p parameters the limits are
// already twice those of a known covariance.
constexpr std::size_t kLeastUnitsOfParameter = 2;
// A unit that is farther off than all but 1 of 10,000 normal units does not join the baseline.
constexpr double kFarAwayProbability = 1e-4;
constexpr int kMostScreens = 5;  // Rounds of Screen; more could shrink the baseline unit by unit.
// The other parameters must leave at least this share of a parameter's variance unexplained; less
// is rounding. Tied parameters leave 1e-16; those of a sensor correlated by 0.999,999 leave 2e-6.
constexpr double kLeastOwnVariance = 1e-8;

// Units with values of all parameters; each parameter is divided by its σ in the baseline.
struct TogetherUnits {
  std::vector<int> parameters;
  std::vector<int> units;
  std::vector<VectorXd> values;
  std::size_t baseline = 0;
  std::vector<bool> good;  // for each unit of the baseline: whether it is no outlier

  bool AreEnough(double count) const {
    return count >= static_cast<double>(kLeastUnitsOfParameter * parameters.size());
  }
};

// Mean and covariance of vectors added one by one.
struct RunningScatter {
  explicit RunningScatter(Index dimension)
      : mean(VectorXd::Zero(dimension)), squares(MatrixXd::Zero(dimension, dimension)) {}

  double count = 0.0;
  VectorXd mean;
  MatrixXd squares;

  void Add(const VectorXd& value) {
    count += 1.0;
    const VectorXd step = value - mean;
    mean += step / count;
    squares.noalias() += (1.0 - 1.0 / count) * step * step.transpose();
  }
  MatrixXd Covariance() const { return squares / (count - 1.0); }
};

// The columns of a covariance that earlier columns do not determine: a column is kept if those kept
// before leave at least 1e-8 of its variance unexplained. Columns without variance are excluded.
std::vector<Index> IndependentColumns(const MatrixXd& covariance) {
  const VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd correlations = scale.asDiagonal() * covariance * scale.asDiagonal();
  std::vector<Index> kept;
  for (Index col = 0; col < covariance.rows(); ++col) {
    if (!(covariance(col, col) > 0.0)) continue;
    double left = 1.0;
    if (!kept.empty()) {
      const Cholesky among(correlations(kept, kept));
      left -= among.SolveLowerVector(correlations(kept, col)).squaredNorm();
    }
    if (left >= kLeastOwnVariance) kept.push_back(col);
  }
  return kept;
}

class Hotelling {
 public:
  Hotelling(TogetherUnits units,
            bool own,
            const std::vector<ChartAlarm>& shifts,
            const ChartPlan& plan)
      : units_(std::move(units)),
        own_(own),
        plan_(plan),
        dimension_(static_cast<Index>(units_.parameters.size())),
        scatter_(dimension_),
        usable_(units_.values.size(), true) {
    Screen();
    if (!HasEnough()) return;
    for (const ChartAlarm& shift : shifts) LeaveOut(shift);
    SetLimits();
  }

  // Whether screening has left enough units of the baseline for a chart.
  bool HasEnough() const { return units_.AreEnough(scatter_.count); }
  double Count() const { return scatter_.count; }

  void DrawTo(StationCharts* station) {
    const std::size_t first = own_ ? 0 : units_.baseline;
    ChartWriter writer(
        ChartKind::kHotelling, -1, units_.values.size() - first, plan_.options.most_points);
    for (std::size_t k = first; k < units_.values.size(); ++k) {
      if (!own_) Follow(k);
      Add(k, &writer);
    }
    writer.chart.line = static_cast<double>(dimension_);
    writer.chart.run_length = 1.0 / plan_.RateOf(ChartKind::kHotelling);
    writer.MoveTo(station);
  }

 private:
  // Removes units of the baseline that are far from the others in all parameters together.
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
        units_.good[k] = root_.SolveLowerVector(units_.values[k] - centre_).squaredNorm() <= limit;
        same = same && units_.good[k];
      }
      if (same) break;
    }
  }

  // Keeps the units of a parameter's alarm out of the baseline, since their level is out of
  // control. Units that have not yet joined the baseline when the alarm begins stay out as well.
  void LeaveOut(const ChartAlarm& shift) {
    if (shift.kind != ChartKind::kEwma) return;
    const auto place_of = [&](auto at) {
      return static_cast<std::size_t>(at - units_.units.begin());
    };
    const std::size_t first =
        place_of(std::lower_bound(units_.units.begin(), units_.units.end(), shift.unit));
    const std::size_t end =
        place_of(std::upper_bound(units_.units.begin(), units_.units.end(), shift.last_unit));
    for (std::size_t k = first - std::min(first, kBaselineLag); k < end; ++k) usable_[k] = false;
  }

  void SetCentre() {
    centre_ = scatter_.mean;
    root_ = Cholesky(scatter_.Covariance());
    count_ = scatter_.count;
  }

  void SetLimits() {
    SetCentre();
    for (const bool own : {false, true}) {
      const auto limit_of = [&](double probability) {
        return HotellingLimit(static_cast<int>(dimension_), probability, count_, own);
      };
      (own ? own_limits_ : later_limits_) = {limit_of(plan_.RateOf(ChartKind::kHotelling)),
                                             limit_of(kFarAwayProbability)};
    }
  }

  void Follow(std::size_t k) {
    if (k < units_.baseline + kBaselineLag) return;
    const std::size_t joining = k - kBaselineLag;
    if (!usable_[joining]) return;
    scatter_.Add(units_.values[joining]);
    if (scatter_.count >= kBaselineGrowth * count_) SetLimits();
  }

  // The parameter whose value is least expected given the others.
  int MostOf(const VectorXd& deviation) const {
    const MatrixXd inverse = root_.Inverse();
    const VectorXd pull = inverse * deviation;
    Index most = 0;
    (pull.cwiseAbs2().cwiseQuotient(inverse.diagonal())).maxCoeff(&most);
    return units_.parameters[static_cast<std::size_t>(most)];
  }

  void Add(std::size_t k, ChartWriter* writer) {
    // A baseline unit is part of the centre, so its deviation has the variance 1 - 1/n. The
    // deviation of another unit has 1 + 1/n.
    const bool is_own = own_ && units_.good[k];
    const Limits& limits = is_own ? own_limits_ : later_limits_;
    const VectorXd deviation = units_.values[k] - centre_;
    const double value =
        root_.SolveLowerVector(deviation).squaredNorm() / (1.0 + (is_own ? -1.0 : 1.0) / count_);
    const bool before = writer->in_alarm();
    const bool alarm = value > limits.single;
    writer->Add({units_.units[k], value, kNoLowerLimit, limits.single}, alarm);
    if (alarm && !before) writer->SetMost(MostOf(deviation));
    if (value > limits.far) usable_[k] = false;
  }

  struct Limits {
    double single = 0.0, far = 0.0;
  };

  TogetherUnits units_;
  bool own_;
  const ChartPlan& plan_;
  Index dimension_;
  RunningScatter scatter_;
  std::vector<bool> usable_;  // for each unit: whether it may join the baseline
  // As of the last SetLimits:
  VectorXd centre_;
  Cholesky root_;
  double count_ = 0.0;
  Limits own_limits_, later_limits_;  // for units in the estimate, and for others
};

// The units of the station with a value of every parameter.
TogetherUnits CompleteUnits(const LineData& data, const std::vector<ParameterValues>& parameters) {
  TogetherUnits together;
  std::set<int> baseline, bad;
  std::vector<double> scale;
  for (const ParameterValues& values : parameters) {
    together.parameters.push_back(values.parameter);
    RunningMoments moments;
    for (std::size_t k = 0; k < values.baseline; ++k) {
      baseline.insert(values.units[k]);
      if (!values.good[k]) bad.insert(values.units[k]);
      if (values.good[k]) moments.Add(values.values[k]);
    }
    scale.push_back(1.0 / std::sqrt(moments.Variance()));
  }
  const Index dimension = static_cast<Index>(parameters.size());
  for (const int unit : parameters.front().units) {
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

// Removes parameters that the others determine.
void LeaveOutDependent(const TogetherUnits& together,
                       std::vector<ParameterValues>* parameters,
                       StationCharts* station) {
  RunningScatter scatter(std::ssize(*parameters));
  for (std::size_t k = 0; k < together.baseline; ++k) {
    if (together.good[k]) scatter.Add(together.values[k]);
  }
  const std::vector<Index> independent = IndependentColumns(scatter.Covariance());
  Index column = 0;
  std::erase_if(*parameters, [&](const ParameterValues& values) {
    const bool is_kept = std::ranges::binary_search(independent, column++);
    if (!is_kept) station->dependent.push_back(values.parameter);
    return !is_kept;
  });
}

void NoteTooFew(std::ptrdiff_t good, std::size_t parameters, StationCharts* station) {
  AddNote("no chart of all parameters together: it needs " +
              std::to_string(kLeastUnitsOfParameter * parameters) +
              " baseline units that are no outliers and have all " + std::to_string(parameters) +
              " parameters; there are " + std::to_string(good),
          station);
}

}  // namespace

void DrawHotelling(const LineData& data,
                   std::vector<ParameterValues> shared,
                   const ChartPlan& plan,
                   StationCharts* station) {
  if (shared.size() < 2) return;
  TogetherUnits together = CompleteUnits(data, shared);
  const auto good = std::count(together.good.begin(), together.good.end(), true);
  if (!together.AreEnough(static_cast<double>(good))) {
    NoteTooFew(good, shared.size(), station);
    return;
  }
  LeaveOutDependent(together, &shared, station);
  if (shared.size() < 2) return;
  if (shared.size() < together.parameters.size()) together = CompleteUnits(data, shared);
  Hotelling chart(std::move(together), shared.front().own, station->alarms, plan);
  if (chart.HasEnough()) {
    chart.DrawTo(station);
  } else {
    NoteTooFew(std::lround(chart.Count()), shared.size(), station);
  }
}

}  // namespace truetriad::line
