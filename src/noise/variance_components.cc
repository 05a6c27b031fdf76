// SPDX-License-Identifier: Apache-2.0
#include "noise/variance_components.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "noise/bounded_step.h"

namespace truetriad {
namespace {

// Chosen: the most steps in a pass. If they have not converged by then, the next pass begins with a
// Fisher step.
constexpr int kMaxScoringSteps = 60;
// The most passes. A pass may end away from the optimum; the next pass begins where it ended.
constexpr int kMostPasses = 3;
// If a step changes each variance by less than this share of the variance's σ, it is the last step.
constexpr double kSettledScoring = 1e-4;
// If a step changes each variance by less than this share of it, Newton's step is used. If a
// variance has changed by more in total, the expected information is computed again.
constexpr double kNearOptimum = 0.3;
// The largest factor by which a step may change a variance. Without this limit, steps overshot
// twentyfold in both directions without end.
constexpr double kLongestStep = 20.0;

// The rows of Z_s D J that belong to component s, for each component. All other rows are zero.
class ComponentRows {
 public:
  using Change = ReducedSystem::VarianceChange;

  ComponentRows(const std::vector<NoiseComponent>& components, const PoseGraph& graph)
      : changes_(components.size()), ZB_(components.size()), sensitivity_(components.size()) {
    for (const VariancePart& part : PartsOf(graph)) {
      const auto at = std::find(components.begin(), components.end(), part.component);
      if (part.rejected || at == components.end()) continue;
      changes_[static_cast<std::size_t>(at - components.begin())].push_back(
          {part.factor, part.row, part.unit / part.weight});
    }
    for (const std::vector<Change>& of_one : changes_) {
      all_.insert(all_.end(), of_one.begin(), of_one.end());
    }
  }

  // Computes the rows from `system`, whose variances are new.
  void Take(const ReducedSystem& system) {
    const auto B = system.B();
    StackedRows some, changed;  // memory for a block of rows in one product
    for (std::size_t s = 0; s < changes_.size(); ++s) {
      const Eigen::Index count = 3 * static_cast<Eigen::Index>(changes_[s].size());
      ZB_[s].resize(count, B.cols());
      sensitivity_[s] = Eigen::MatrixXd::Zero(B.cols(), B.cols());
      for (Eigen::Index begin = 0; begin < count; begin += kRowsAtOnce) {
        const Eigen::Index rows = std::min(kRowsAtOnce, count - begin);
        some.resize(rows, B.cols());
        changed.setZero(rows, B.cols());
        for (Eigen::Index at = 0; at < rows; at += 3) {
          const Change& change = changes_[s][static_cast<std::size_t>((begin + at) / 3)];
          some.middleRows<3>(at) = B.middleRows<3>(RowOf(change, system));
          AddProduct(1.0, change.change, some.middleRows<3>(at), changed.middleRows<3>(at));
        }
        sensitivity_[s] += SymmetricProduct(some, changed);
        ZB_[s].middleRows(begin, rows) = changed;
      }
    }
  }

  // C_s, see ExcessEstimate.
  const Eigen::MatrixXd& Sensitivity(std::size_t s) const { return sensitivity_[s]; }

  // D Z_t D J, all rows.
  StackedRows Projected(std::size_t t, const ReducedSystem& system) const {
    StackedRows all = StackedRows::Zero(system.residual().size(), ZB_[t].cols());
    Eigen::Index at = 0;
    for (const Change& change : changes_[t]) {
      all.middleRows<3>(RowOf(change, system)) = ZB_[t].middleRows<3>(at);
      at += 3;
    }
    return system.Project(std::move(all));
  }

  // Selects the rows of component s from a matrix with all rows.
  StackedRows RowsOf(std::size_t s, const StackedRows& all, const ReducedSystem& system) const {
    StackedRows own(ZB_[s].rows(), all.cols());
    Eigen::Index at = 0;
    for (const Change& change : changes_[s]) {
      own.middleRows<3>(at) = all.middleRows<3>(RowOf(change, system));
      at += 3;
    }
    return own;
  }

  static Eigen::Index RowOf(const Change& change, const ReducedSystem& system) {
    return system.factors()[change.factor].row + change.row;
  }

  std::size_t size() const { return changes_.size(); }
  const std::vector<Change>& changes(std::size_t s) const { return changes_[s]; }
  const std::vector<Change>& all_changes() const { return all_; }
  const StackedRows& ZB(std::size_t s) const { return ZB_[s]; }

 private:
  std::vector<std::vector<Change>> changes_;
  std::vector<Change> all_;
  std::vector<StackedRows> ZB_;
  std::vector<Eigen::MatrixXd> sensitivity_;
};

// Score of the components and their average information 1/2 r^T P Z_s P Z_t P r: the mean of the
// observed and the expected information, since V is linear in the components. Gilmour, Thompson and
// Cullis 1995.
void ScoreOf(const ComponentRows& rows,
             const ReducedSystem& system,
             Eigen::VectorXd* score,
             Eigen::MatrixXd* average) {
  const Eigen::Index count = score->size();
  StackedRows Zq = StackedRows::Zero(system.residual().size(), count);  // Z_s P r
  for (Eigen::Index s = 0; s < count; ++s) {
    double sum = 0.0;
    for (const ReducedSystem::VarianceChange& change : rows.changes(static_cast<std::size_t>(s))) {
      const Eigen::Index row = ComponentRows::RowOf(change, system);
      const Eigen::Vector3d q = system.projected().segment<3>(row);
      const Eigen::Vector3d changed = change.change * q;
      Zq.block<3, 1>(row, s) = changed;
      sum += q.dot(changed) -
             system.ProjectorBlock(change.factor, change.row).cwiseProduct(change.change).sum();
    }
    (*score)[s] = 0.5 * sum;
  }
  const Eigen::MatrixXd shared = TransposeTimesRows(system.B(), Zq);
  *average = 0.5 * (TransposeTimesRows(Zq, system.Project(Zq)) -
                    TransposeTimes(shared, Times(system.covariance(), shared)));
}

// D Z_s D J of every component.
std::vector<StackedRows> AllProjected(const ComponentRows& rows, const ReducedSystem& system) {
  std::vector<StackedRows> all;
  for (std::size_t s = 0; s < rows.size(); ++s) all.push_back(rows.Projected(s, system));
  return all;
}

// Fisher information of the components; `rows` are those of `system`.
Eigen::MatrixXd FisherOf(const ComponentRows& rows,
                         const std::vector<StackedRows>& all_projected,
                         const ReducedSystem& system) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  std::vector<Eigen::MatrixXd> MC;  // M^-1 C_s
  for (std::size_t s = 0; s < rows.size(); ++s) {
    MC.push_back(Times(system.covariance(), rows.Sensitivity(s)));
  }
  Eigen::MatrixXd fisher(count, count);
  for (Eigen::Index t = 0; t < count; ++t) {
    const auto second = static_cast<std::size_t>(t);
    // tr(D Z_s D Z_t) is minus the change of tr(D Z_s) when V changes by Z_t.
    const std::vector<Eigen::Matrix3d> derivative =
        system.ProjectorDerivative(rows.changes(second), rows.all_changes());
    const StackedRows& projected = all_projected[second];
    std::size_t listed = 0;
    for (Eigen::Index s = 0; s < count; ++s) {
      const auto first = static_cast<std::size_t>(s);
      double sum = 0.0;
      for (const ReducedSystem::VarianceChange& change : rows.changes(first)) {
        sum -= derivative[listed++].cwiseProduct(change.change).sum();
        if (s < t) continue;
        const Eigen::Index row = ComponentRows::RowOf(change, system);
        const Eigen::Matrix3d inner =
            system.BM().middleRows<3>(row).lazyProduct(projected.middleRows<3>(row).transpose());
        sum -= 2.0 * inner.cwiseProduct(change.change).sum();
      }
      if (s < t) continue;
      sum += MC[first].cwiseProduct(MC[second].transpose()).sum();
      fisher(s, t) = fisher(t, s) = 0.5 * sum;
    }
  }
  return fisher;
}

// Whether the information computed at the variances `from` is a good approximation at the variances
// `to`.
bool IsNear(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  const Eigen::ArrayXd ratio = (from.array() / to.array()).log();
  return ratio.abs().maxCoeff() < kNearOptimum;
}

// The information, rescaled to other variances: to first order it falls with their square.
Eigen::MatrixXd Rescaled(const Eigen::MatrixXd& information,
                         const Eigen::VectorXd& from,
                         const Eigen::VectorXd& to) {
  const Eigen::VectorXd ratio = from.cwiseQuotient(to);
  return ScaledBothSides(ratio, information);
}

// Limits the scoring steps: far from the optimum they overshoot back and forth without end.
class ScoringReach {
 public:
  explicit ScoringReach(Eigen::Index count)
      : factor_(Eigen::VectorXd::Constant(count, kLongestStep)),
        last_step_(Eigen::VectorXd::Zero(count)) {}

  // The lower limits of a step. `total`: the components' variances, excess and known part together.
  Eigen::VectorXd Limit(const std::vector<NoiseComponent>& components,
                        const ExcessVariance& floor,
                        const ExcessVariance& variance,
                        const Eigen::VectorXd& total) const {
    Eigen::VectorXd limit = (factor_.cwiseInverse().array() - 1.0) * total.array();
    for (Eigen::Index s = 0; s < limit.size(); ++s) {
      const NoiseComponent component = components[static_cast<std::size_t>(s)];
      limit[s] = std::max(floor[component] - variance[component], limit[s]);
    }
    return limit;
  }

  // Limits a step. If a long step has the opposite direction of the last step, first reduces the
  // largest factor to its square root.
  void Shorten(const Eigen::VectorXd& total, Eigen::VectorXd* step) {
    for (Eigen::Index s = 0; s < total.size(); ++s) {
      double& along = (*step)[s];
      const bool is_long = std::abs(along) > kNearOptimum * total[s];
      if (is_long && along * last_step_[s] < 0.0) factor_[s] = std::sqrt(factor_[s]);
      along = std::clamp(along, (1.0 / factor_[s] - 1.0) * total[s], (factor_[s] - 1.0) * total[s]);
    }
    last_step_ = *step;
  }

 private:
  Eigen::VectorXd factor_;  // Largest factor by which a step may change a total.
  Eigen::VectorXd last_step_;
};

// The component with the largest score in its own σ, except those at their floor with a negative
// score.
OffOptimum FurthestOff(const std::vector<NoiseComponent>& components,
                       const ExcessVariance& variance,
                       const ExcessVariance& floor,
                       const Eigen::VectorXd& score,
                       const Eigen::MatrixXd& information) {
  OffOptimum furthest;
  for (Eigen::Index s = 0; s < score.size(); ++s) {
    const NoiseComponent component = components[static_cast<std::size_t>(s)];
    const double sigma = std::sqrt(std::max(information(s, s), 0.0));
    const bool at_floor = variance[component] <= floor[component];
    const double sigmas = at_floor ? std::max(score[s] / sigma, 0.0) : std::abs(score[s] / sigma);
    if (furthest.component && sigmas <= furthest.score_sigmas) continue;
    furthest.component = component;
    furthest.score_sigmas = sigmas;
  }
  return furthest;
}

// Iterates the variances until the restricted likelihood has its optimum.
class Scoring {
 public:
  Scoring(const std::vector<NoiseComponent>& components,
          const ExcessEstimate& before,
          const ExcessVariance& start,
          const ExcessVariance& floor,
          PoseGraph* graph,
          ReducedSystem* system)
      : components_(components),
        floor_(floor),
        graph_(graph),
        system_(system),
        count_(static_cast<Eigen::Index>(components.size())),
        rows_(components, *graph),
        variance_(start),
        known_(count_),
        score_(Eigen::VectorXd::Zero(count_)) {
    for (Eigen::Index s = 0; s < count_; ++s) {
      known_[s] = MeanKnownVariance(*graph, components[static_cast<std::size_t>(s)]);
    }
    if (before.components == components) {
      fisher_ = before.fisher;
      fisher_at_ = Totals(before.variance);
    }
    ScoreOf(rows_, *system_, &score_, &average_);
  }

  // Takes steps until these are negligible. On return the score is at the present variances.
  void Run() {
    ScoringReach reach(count_);
    double last_change = 0.0;
    for (int iteration = 0; iteration < kMaxScoringSteps; ++iteration) {
      const double largest_change = TakeStep(NextStep(&reach));
      ApplyExcess(variance_, graph_);
      system_->Eliminate(*graph_);
      ScoreOf(rows_, *system_, &score_, &average_);
      // The change that is still to come if the steps go on shrinking at the same rate.
      const double contraction = iteration > 0 ? std::min(largest_change / last_change, 1.0) : 1.0;
      if (!(largest_change * contraction > kSettledScoring)) break;
      last_change = largest_change;
    }
  }

  // Discards the information, so that the next step is Fisher's.
  void Forget() { fisher_.resize(0, 0); }

  OffOptimum off() const {
    return FurthestOff(components_, variance_, floor_, score_, FisherHere());
  }

  ExcessEstimate Finish() {
    ExcessEstimate estimate;
    estimate.variance = variance_;
    estimate.components = components_;
    if (fisher_.size() == 0 || !IsNear(fisher_at_, Totals(variance_))) UpdateFisher();
    estimate.fisher = FisherHere();
    estimate.covariance = BalancedInverse(estimate.fisher);
    return estimate;
  }

 private:
  Eigen::VectorXd Totals(const ExcessVariance& variance) const {
    Eigen::VectorXd all = known_;
    for (Eigen::Index s = 0; s < count_; ++s) {
      all[s] += variance[components_[static_cast<std::size_t>(s)]];
    }
    return all;
  }

  void UpdateFisher() {
    rows_.Take(*system_);
    fisher_ = FisherOf(rows_, AllProjected(rows_, *system_), *system_);
    fisher_at_ = Totals(variance_);
  }

  Eigen::MatrixXd FisherHere() const { return Rescaled(fisher_, fisher_at_, Totals(variance_)); }

  // The step is Newton's if the optimum is near and the expected information is known. The observed
  // information is then twice the average information minus the expected one. Otherwise the step is
  // Fisher's.
  Eigen::VectorXd NextStep(ScoringReach* reach) {
    const Eigen::VectorXd total = Totals(variance_);
    const Eigen::VectorXd limit = reach->Limit(components_, floor_, variance_, total);
    Eigen::VectorXd step;
    if (fisher_.size() > 0 && IsNear(fisher_at_, total)) {
      const Eigen::MatrixXd observed = 2.0 * average_ - FisherHere();
      const bool is_convex = Cholesky(observed).is_positive();
      step = StepAbove(limit, is_convex ? observed : average_, score_);
    }
    if (step.size() == 0 || !(step.array().abs() < kNearOptimum * total.array()).all()) {
      UpdateFisher();
      step = StepAbove(limit, fisher_, score_);
    }
    reach->Shorten(total, &step);
    return step;
  }

  // Changes the variances by `step`. Returns the largest change, in units of the variance's σ.
  double TakeStep(const Eigen::VectorXd& step) {
    const Eigen::MatrixXd expected = FisherHere();
    double largest_change = 0.0;
    for (Eigen::Index s = 0; s < count_; ++s) {
      const NoiseComponent component = components_[static_cast<std::size_t>(s)];
      double& variance = variance_[component];
      const double sigma = std::sqrt(std::max(1.0 / expected(s, s), 0.0));
      double next = variance + step[s];
      if (next < 1e-9 * sigma) next = 0.0;
      next = std::isfinite(next) ? std::max(next, floor_[component]) : variance;
      largest_change = std::max(largest_change, std::abs(next - variance) / sigma);
      variance = next;
    }
    return largest_change;
  }

  const std::vector<NoiseComponent>& components_;
  const ExcessVariance& floor_;
  PoseGraph* graph_;
  ReducedSystem* system_;
  Eigen::Index count_;
  ComponentRows rows_;
  ExcessVariance variance_;
  Eigen::VectorXd known_;
  Eigen::VectorXd score_;
  Eigen::MatrixXd average_;
  Eigen::MatrixXd fisher_;  // expected information at the total variances `fisher_at_`
  Eigen::VectorXd fisher_at_;
};

}  // namespace

ExcessEstimate EstimateExcess(const std::vector<NoiseComponent>& components,
                              const ExcessEstimate& before,
                              const ExcessVariance& start,
                              const ExcessVariance& floor,
                              PoseGraph* graph,
                              ReducedSystem* system) {
  Scoring scoring(components, before, start, floor, graph, system);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    scoring.Run();
    if (scoring.off().IsSettled()) break;
    // The steps did not reach the optimum, so the next pass begins with a Fisher step.
    scoring.Forget();
  }
  return scoring.Finish();
}

OffOptimum FurthestOff(const ExcessEstimate& estimate,
                       const ExcessVariance& floor,
                       const PoseGraph& graph,
                       const ReducedSystem& system) {
  if (estimate.components.empty()) return {};
  const ComponentRows rows(estimate.components, graph);
  Eigen::VectorXd score = Eigen::VectorXd::Zero(estimate.fisher.rows());
  Eigen::MatrixXd average;
  ScoreOf(rows, system, &score, &average);
  return FurthestOff(estimate.components, estimate.variance, floor, score, estimate.fisher);
}

VarianceTraces TracesOf(const std::vector<NoiseComponent>& components,
                        const PoseGraph& graph,
                        const ReducedSystem& system) {
  ComponentRows rows(components, graph);
  rows.Take(system);
  VarianceTraces found{Eigen::VectorXd::Zero(std::ssize(components)),
                       FisherOf(rows, AllProjected(rows, system), system)};
  for (std::size_t s = 0; s < rows.size(); ++s) {
    for (const ReducedSystem::VarianceChange& change : rows.changes(s)) {
      found.traces[static_cast<Eigen::Index>(s)] +=
          system.ProjectorBlock(change.factor, change.row).cwiseProduct(change.change).sum();
    }
  }
  return found;
}

void StateCurvatures(const PoseGraph& graph,
                     const ReducedSystem& system,
                     ExcessEstimate* estimate) {
  const std::size_t count = estimate->components.size();
  if (count == 0) return;
  ComponentRows rows(estimate->components, graph);
  rows.Take(system);
  const std::vector<StackedRows> projected = AllProjected(rows, system);
  estimate->fisher = FisherOf(rows, projected, system);
  estimate->covariance = BalancedInverse(estimate->fisher);
  estimate->sensitivities.clear();
  for (std::size_t s = 0; s < count; ++s) {
    estimate->sensitivities.push_back(rows.Sensitivity(s));
  }
  estimate->curvatures.resize(count * count);
  for (std::size_t t = 0; t < count; ++t) {
    const Eigen::MatrixXd through = Times(system.covariance(), estimate->sensitivities[t]);
    for (std::size_t s = t; s < count; ++s) {
      Eigen::MatrixXd& pair = estimate->curvatures[s * count + t];
      pair = TransposedProduct(rows.ZB(s), rows.RowsOf(s, projected[t], system));
      pair -= Times(estimate->sensitivities[s], through);
      if (s != t) estimate->curvatures[t * count + s] = pair.transpose();
    }
  }
}

double ExcessDegreesOfFreedom(const ExcessEstimate& estimate,
                              const PoseGraph& graph,
                              NoiseComponent component) {
  const auto at = std::find(estimate.components.begin(), estimate.components.end(), component);
  if (at == estimate.components.end()) return std::numeric_limits<double>::infinity();
  const auto s = at - estimate.components.begin();
  const double total = estimate.variance[component] + MeanKnownVariance(graph, component);
  return 2.0 * total * total / estimate.covariance(s, s);
}

}  // namespace truetriad
