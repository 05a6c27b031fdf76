// SPDX-License-Identifier: Apache-2.0
//
// Charts of one parameter's subgroups: means and standard deviations within.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "line/baseline.h"
#include "line/chart_limits.h"
#include "line/chart_plan.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

// With fewer, limits are so wide that they say nothing.
constexpr int kLeastDof = 10;
// A single one has nothing to be held against.
constexpr std::size_t kLeastSubgroups = 2;

struct Subgroup {
  std::size_t last = 0;  // place of its last value
  RunningMoments moments;
  bool own = false;  // all of it is in the estimate that it is held against
};

// σ within subgroups and the mean of their values.
struct WithinSubgroups {
  RunningMoments all;
  double squares = 0.0, dof = 0.0;

  void Add(const Subgroup& group) {
    const RunningMoments& moments = group.moments;
    if (moments.count == 0.0) return;
    all.count += moments.count;
    all.mean += (moments.mean - all.mean) * moments.count / all.count;
    squares += moments.squares;
    dof += moments.count - 1.0;
  }
};

class Subgroups {
 public:
  Subgroups(const ParameterValues& values, const ChartPlan& plan)
      : values_(values), plan_(plan), groups_(GroupsOf(values)) {
    for (const Subgroup& group : groups_) {
      if (group.last < values.baseline) ++first_;
    }
    for (std::size_t g = 0; g < first_; ++g) {
      const Subgroup good = GoodOf(g);
      groups_[g].own = values.own && good.moments.count == groups_[g].moments.count;
      within_.Add(good);
    }
    in_baseline_ = first_;
    joined_ = first_;
    if (values.own) first_ = 0;
    usable_.assign(groups_.size(), true);
    SetNormal();
  }

  // Why there are no charts; empty: there are.
  std::string Lack() const {
    if (in_baseline_ >= kLeastSubgroups && within_.dof >= kLeastDof && sigma_ > 0.0) return "";
    return "too few subgroups, " + std::to_string(in_baseline_) + " in the baseline with " +
           std::to_string(std::lround(within_.dof)) + " degrees of freedom within; it takes " +
           std::to_string(kLeastSubgroups) + " with " + std::to_string(kLeastDof);
  }

  void DrawTo(StationCharts* station) {
    std::optional<ChartWriter> mean = WriterOf(ChartKind::kXBar);
    std::optional<ChartWriter> spread = WriterOf(ChartKind::kS);
    for (std::size_t g = first_; g < groups_.size(); ++g) {
      if (!values_.own) Follow(groups_[g].last);
      const bool mean_outside = mean && AddMean(groups_[g], &*mean);
      const bool spread_outside = spread && AddSpread(groups_[g], &*spread);
      usable_[g] = !mean_outside && !spread_outside;
    }
    for (std::optional<ChartWriter>* writer : {&mean, &spread}) {
      if (*writer) Finish(&**writer, station);
    }
  }

 private:
  static std::vector<Subgroup> GroupsOf(const ParameterValues& values) {
    std::vector<Subgroup> groups;
    for (std::size_t k = 0; k < values.values.size(); ++k) {
      if (values.subgroups[k] < 0) continue;
      if (k == 0 || values.subgroups[k] != values.subgroups[k - 1]) groups.emplace_back();
      groups.back().last = k;
      groups.back().moments.Add(values.values[k]);
    }
    return groups;
  }

  // The subgroup without the baseline's outliers.
  Subgroup GoodOf(std::size_t g) const {
    Subgroup good{groups_[g].last, {}};
    for (std::size_t k = g == 0 ? 0 : groups_[g - 1].last + 1; k <= good.last; ++k) {
      if (values_.good[k]) good.moments.Add(values_.values[k]);
    }
    return good;
  }

  std::optional<ChartWriter> WriterOf(ChartKind kind) const {
    if (!plan_.Has(kind)) return std::nullopt;
    return ChartWriter(kind, values_.parameter, groups_.size() - first_, plan_.options.most_points);
  }

  void SetNormal() {
    known_ = {within_.all.count, within_.dof, values_.own};
    centre_ = within_.all.mean;
    sigma_ = std::sqrt(within_.squares / std::max(within_.dof, 1.0));
    limits_.clear();
  }

  void Follow(std::size_t place) {
    for (; groups_[joined_].last + kBaselineLag <= place; ++joined_) {
      if (usable_[joined_]) within_.Add(groups_[joined_]);
    }
    if (within_.dof >= kBaselineGrowth * known_.dof) SetNormal();
  }

  struct Limits {
    double mean = 0.0;
    SpreadLimits spread;
  };

  // Quantiles take long, and most subgroups have the same size.
  const Limits& LimitsOf(const Subgroup& group) {
    const int size = static_cast<int>(group.moments.count);
    const auto [at, is_new] = limits_.try_emplace({size, group.own});
    if (is_new) {
      Known known = known_;
      known.own = group.own;
      // As many false alarms a unit as the plan has: a subgroup has that of each of its units.
      const double mean_alarms = std::min(plan_.RateOf(ChartKind::kXBar) * size, 0.5);
      const double spread_alarms = std::min(plan_.RateOf(ChartKind::kS) * size, 0.5);
      if (mean_alarms > 0.0) {
        at->second.mean =
            PredictiveLimit(-NormalQuantile(0.5 * mean_alarms), 1.0 / size, 1.0, known);
      }
      if (spread_alarms > 0.0 && HasSpread(group)) {
        at->second.spread = LimitsOfSpread(size, spread_alarms, known);
      }
    }
    return at->second;
  }

  // Whether there is a spread within, and another that it can be held against.
  bool HasSpread(const Subgroup& group) const {
    const double dof = group.moments.count - 1.0;
    return dof > 0.0 && (!group.own || known_.dof > dof);
  }

  bool AddMean(const Subgroup& group, ChartWriter* writer) {
    const double limit = LimitsOf(group).mean;
    const double value = (group.moments.mean - centre_) / sigma_;
    const bool outside = std::abs(value) > limit;
    writer->Add({values_.units[group.last], value, -limit, limit}, outside);
    return outside;
  }

  bool AddSpread(const Subgroup& group, ChartWriter* writer) {
    if (!HasSpread(group)) return false;
    const SpreadLimits& limits = LimitsOf(group).spread;
    const double value = std::sqrt(group.moments.Variance()) / sigma_;
    const bool outside = value < limits.lower || value > limits.upper;
    writer->Add({values_.units[group.last], value, limits.lower, limits.upper}, outside);
    return outside;
  }

  void Finish(ChartWriter* writer, StationCharts* station) const {
    Chart& chart = writer->chart;
    chart.line = chart.kind == ChartKind::kS ? MeanSpread() : 0.0;
    chart.run_length = 1.0 / plan_.RateOf(chart.kind);
    chart.centre = centre_;
    chart.sigma = sigma_ / C4(known_.dof + 1.0);
    writer->MoveTo(station);
  }

  // Of the subgroups drawn, in control and in σ.
  double MeanSpread() const {
    RunningMoments spreads;
    for (std::size_t g = first_; g < groups_.size(); ++g) {
      if (HasSpread(groups_[g])) spreads.Add(C4(groups_[g].moments.count));
    }
    return spreads.mean;
  }

  const ParameterValues& values_;
  const ChartPlan& plan_;
  std::vector<Subgroup> groups_;
  std::size_t in_baseline_ = 0;
  std::size_t first_ = 0;   // that is drawn
  std::size_t joined_ = 0;  // those before are in the baseline, or left out for good
  std::vector<bool> usable_;
  WithinSubgroups within_;
  Known known_;
  double centre_ = 0.0, sigma_ = 0.0;
  std::map<std::pair<int, bool>, Limits> limits_;  // by size and whether it is own
};

}  // namespace

std::string DrawSubgroups(const ParameterValues& values,
                          const ChartPlan& plan,
                          StationCharts* station) {
  Subgroups subgroups(values, plan);
  std::string lack = subgroups.Lack();
  if (lack.empty()) subgroups.DrawTo(station);
  return lack;
}

}  // namespace truetriad::line
