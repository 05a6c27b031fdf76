// SPDX-License-Identifier: Apache-2.0
#include "choice/model_choice.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "choice/open_models.h"
#include "math/dense/cholesky.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "noise/joint_test.h"
#include "problem/graph_builder.h"
#include "solve/solve_graph.h"
#include "verdict/checks/soak.h"
#include "verdict/quality.h"

namespace truetriad {
namespace {

// The significance level of the likelihood ratio. If this were the only criterion, 1 % of
// nonexistent terms would stay.
constexpr double kLevel = 0.01;
// If the p-value of a term is smaller, the term stays, whatever BIC and held-out error are: if it
// were removed, the verdict would find it in the residuals and warn or refuse. This does not hold
// for temperature terms: poses of one temperature share an error, which makes their p-values too
// small.
constexpr double kShownLevel = 1e-3;
// Higher terms are tested only if they leave at least this many residual degrees of freedom, and
// nothing is tested if the matrices alone leave fewer. With fewer, hardly any likelihood ratio
// would be significant, and the chosen model would be too small. No σ shows the error of a model
// that is too small, while a model that is too large has large σ.
constexpr double kLeastDof = 10.0;
// This limit, far above the number of terms, ends a choice that repeats itself.
constexpr int kMostSteps = 100;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The solution of one candidate, with the noise and the weights of the largest model.
struct Fit {
  PoseGraph graph;
  double chi2 = kInfinity;
  // Computed at first use.
  std::optional<std::optional<double>> held_out;
  std::optional<std::vector<TemperatureSetting>> settings;
  int parameters() const { return graph.layout.free_size(); }
};

int HighestOrderOf(const SharedLayout& layout) {
  int highest = 0;
  for (const ThermalBlock& block : layout.thermal) {
    highest = std::max({highest, block.terms.bias_order, block.terms.matrix_order});
  }
  return highest;
}

// Directions of the larger model's free coordinates, at its optimum, that the smaller model lacks.
Eigen::MatrixXd TestedDirections(const PoseGraph& larger, const PoseGraph& smaller) {
  const SharedLayout& layout = larger.layout;
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(layout.size, smaller.layout.free_size());
  const std::vector<int> places = PlacesIn(layout, smaller.layout);
  for (std::size_t i = 0; i < places.size(); ++i) {
    moved.row(places[i]) = smaller.layout.basis.row(static_cast<Eigen::Index>(i));
  }
  // If the larger model holds the strength of the field fixed, a change of the strength appears as
  // a change of the magnetometer's scale.
  const int field = layout.reference + kField;
  if (!layout.IsFree(field) && layout.Has(Triad::kMagnetometer)) {
    const Eigen::RowVectorXd strength = moved.row(field) / larger.reference()[kField];
    moved.middleRows<9>(layout.sensitivity[Triad::kMagnetometer]) +=
        larger.sensitivity(Triad::kMagnetometer).reshaped() * strength;
  }
  return LeastSquares(TransposeTimes(layout.basis, moved)).Complement();
}

// The fits of the candidate models, and the criteria by which they are compared.
class Candidates {
 public:
  Candidates(const OpenModels& models, const Choice& largest, int folds, SettledModel settled)
      : models_(models),
        largest_choice_(largest),
        noise_(std::move(settled.noise)),
        largest_(std::move(settled.graph)) {
    for (const PoseNode& node : largest_.nodes) {
      for (const Observation& seen : node.observations) rows_ += seen.rejected ? 0 : 3;
    }
    for (const IncrementEdge& edge : largest_.increments) rows_ += edge.rejected ? 0 : 3;
    // Poses of one temperature share an error: only poses of others can test a polynomial.
    groups_ = models.HasThermalChoice() && folds > 0 ? GroupsOfSettings(largest_)
                                                     : GroupsOfPosesAndTurns(largest_, folds);
    Fit& fit = fits_[largest];
    fit.graph = largest_;
    Solve(&fit);
  }

  // Whether the largest model contains the choice.
  bool Holds(const Choice& choice) const {
    return std::equal(choice.begin(), choice.end(), largest_choice_.begin(), std::less_equal<>());
  }

  Fit& FitOf(const Choice& choice) {
    const auto [found, is_new] = fits_.try_emplace(choice);
    if (is_new) {
      found->second.graph = WithTermsOf(models_.OptionsOf(choice), largest_);
      Solve(&found->second);
    }
    return found->second;
  }

  double BicOf(const Fit& fit) const {
    return fit.chi2 + fit.parameters() * std::log(static_cast<double>(rows_));
  }

  const std::optional<double>& HeldOutOf(Fit* fit) const {
    if (fit->held_out) return *fit->held_out;
    fit->held_out.emplace();
    // If one temperature is held out, a polynomial of order n needs n + 1 other temperatures.
    if (!models_.HasThermalChoice() ||
        HighestOrderOf(fit->graph.layout) + 2 <= static_cast<int>(groups_.size())) {
      *fit->held_out = HeldOutError(fit->graph, groups_);
    }
    return *fit->held_out;
  }

  // P-value of the likelihood ratio of two nested models, one `step` apart. An error that the poses
  // of one temperature share is no evidence that the bias depends on temperature: such terms are
  // thus compared with the scatter between temperatures, which has only a few degrees of freedom.
  double PValue(Fit* larger, const Fit& smaller, const Neighbour& step) const {
    const Eigen::MatrixXd tested = TestedDirections(larger->graph, smaller.graph);
    const double count = static_cast<double>(tested.cols());
    const double ratio = std::max(smaller.chi2 - larger->chi2, 0.0);
    if (count < 1.0) return 1.0;
    if (!std::isfinite(ratio)) return 0.0;
    const ReducedSystem system(larger->graph);
    const JointTest test = KenwardRogerTest(noise_.estimate, system, larger->graph, tested);
    const double p = 1.0 - FisherCdf(test.scale * ratio / count, count, test.dof);
    if (!step.thermal_triad || p >= kLevel) return p;
    const Triad triad = *step.thermal_triad;
    if (!larger->settings) larger->settings = FindTemperatureSettings(larger->graph);
    const SettingScatter scatter = ScatterOf(larger->graph, system, *larger->settings, triad);
    if (scatter.dof <= 0.0) return p;
    if (step.is_of_bias) {
      // The scatter may be below the noise by chance.
      const double noise = std::max(scatter.ratio, 1.0);
      return std::max(p, 1.0 - FisherCdf(ratio / count / noise, count, scatter.dof));
    }
    // The poses of one temperature determine a sensitivity by themselves. An error that they share
    // changes it only if their directions are uneven. Degrees of freedom after Satterthwaite 1946.
    const Eigen::MatrixXd drift =
        TransposedCongruence(tested, DriftOf(larger->graph, system, triad, scatter.variance_raw));
    const PivotedCholesky own(TransposedCongruence(tested, system.covariance()));
    const double share = own.Solve(drift).trace() / count;
    const double dof = std::pow(1.0 + share, 2) / (share * share / scatter.dof + 1.0 / test.dof);
    return std::max(p, 1.0 - FisherCdf(ratio / count / (1.0 + share), count, dof));
  }

  // Whether the larger of two models is worth its parameters; `step` is the step between them.
  bool IsWorthIt(Fit* larger, Fit* smaller, const Neighbour& step, double p_value) const {
    if (p_value < kShownLevel && !step.thermal_triad) return true;
    if (p_value >= kLevel || BicOf(*larger) >= BicOf(*smaller)) return false;
    const std::optional<double>& with = HeldOutOf(larger);
    const std::optional<double>& without = HeldOutOf(smaller);
    return !with || !without || *with < *without;
  }

 private:
  // If a fit does not converge, its χ² stays infinite.
  static void Solve(Fit* fit) {
    const SolveOutcome outcome = SolveGraph(&fit->graph);
    if (outcome.converged && std::isfinite(outcome.final_cost))
      fit->chi2 = 2.0 * outcome.final_cost;
  }

  const OpenModels& models_;
  Choice largest_choice_;
  std::vector<HeldOutGroup> groups_;
  NoiseState noise_;
  PoseGraph largest_;
  int rows_ = 0;
  std::map<Choice, Fit> fits_;  // a map, so that references to its fits stay valid
};

// The criteria of a model; `p_value` is that of the step that leads to it.
ModelAlternative Described(const std::string& description,
                           Fit* fit,
                           std::optional<double> p_value,
                           const Candidates& candidates) {
  ModelAlternative alternative;
  alternative.description = description;
  alternative.parameters = fit->parameters();
  alternative.minus_2_log_l = fit->chi2;
  alternative.p_value = p_value;
  alternative.bic = candidates.BicOf(*fit);
  alternative.held_out = candidates.HeldOutOf(fit);
  return alternative;
}

// One step: removes the least significant of the terms that are not worth their parameters. If
// there is none, adds the most significant of the missing terms that are worth their parameters.
// Unset if there is no such term either.
std::optional<ModelAlternative> Improve(const OpenModels& models,
                                        Candidates* candidates,
                                        Choice* choice) {
  Fit& present = candidates->FitOf(*choice);
  const std::vector<Neighbour> neighbours = models.NeighboursOf(*choice);
  for (const bool is_larger : {false, true}) {
    const Neighbour* step = nullptr;
    double step_p = is_larger ? kInfinity : -1.0;
    for (const Neighbour& neighbour : neighbours) {
      if (neighbour.is_larger != is_larger || !candidates->Holds(neighbour.choice)) continue;
      Fit& other = candidates->FitOf(neighbour.choice);
      Fit& larger = is_larger ? other : present;
      Fit& smaller = is_larger ? present : other;
      const double p = candidates->PValue(&larger, smaller, neighbour);
      const bool is_further = is_larger ? p < step_p : p > step_p;
      if (!is_further || candidates->IsWorthIt(&larger, &smaller, neighbour, p) != is_larger) {
        continue;
      }
      step_p = p;
      step = &neighbour;
    }
    if (step == nullptr) continue;
    *choice = step->choice;
    return Described(step->description, &candidates->FitOf(*choice), step_p, *candidates);
  }
  return std::nullopt;
}

// The chosen model, then the models that differ from it by one step.
std::vector<ModelAlternative> AlternativesTo(const OpenModels& models,
                                             const Choice& choice,
                                             Candidates* candidates) {
  Fit& chosen = candidates->FitOf(choice);
  std::vector<ModelAlternative> alternatives = {
      Described(models.DescriptionOf(choice), &chosen, std::nullopt, *candidates)};
  alternatives.front().chosen = true;
  for (const Neighbour& neighbour : models.NeighboursOf(choice)) {
    if (!candidates->Holds(neighbour.choice)) continue;
    Fit& fit = candidates->FitOf(neighbour.choice);
    const double p = neighbour.is_larger ? candidates->PValue(&fit, chosen, neighbour)
                                         : candidates->PValue(&chosen, fit, neighbour);
    alternatives.push_back(Described(neighbour.description, &fit, p, *candidates));
  }
  return alternatives;
}

// Whether the smaller model's χ² is significantly larger. F is the increase of χ² per removed term
// divided by the larger model's reduced χ²; its distribution allows for few degrees of freedom.
bool IsFarWorse(const Quality& smaller, const Quality& larger) {
  // At this level a nonexistent term is kept once in a thousand.
  constexpr double kFarLevel = 1e-3;
  const double terms = smaller.dof - larger.dof;
  const double left = larger.reduced_chi2_before * larger.dof;
  const double more = smaller.reduced_chi2_before * smaller.dof - left;
  if (!(terms >= 1.0 && larger.dof >= 1.0 && left > 0.0 && more > 0.0)) return false;
  return 1.0 - FisherCdf(more / terms / larger.reduced_chi2_before, terms, larger.dof) < kFarLevel;
}

}  // namespace

Result<CalibrationSummary> CalibrateWithChoice(const CalibrateOptions& options,
                                               int temperatures,
                                               const CalibrateOnce& calibrate) {
  const OpenModels models(options, temperatures);
  Choice choice = models.Largest();
  SettledModel settled;
  struct Larger {
    Choice choice;
    SettledModel settled;
    Quality quality;
  };
  std::optional<Larger> larger;  // a larger model that is usable, but has few degrees of freedom
  for (;;) {
    Result<CalibrationSummary> summary = calibrate(models.OptionsOf(choice), &settled);
    if (!summary || options.initialise.only) return summary;
    const Quality& quality = summary->calibration.quality;
    const bool usable = summary->calibration.IsUsable();
    const bool few = quality.dof < kLeastDof;
    if (larger && (!usable || IsFarWorse(quality, larger->quality))) {
      choice = larger->choice;
      settled = std::move(larger->settled);
      break;
    }
    if (usable && !few) break;
    larger.reset();
    if (usable) larger = Larger{choice, settled, quality};
    if (models.Shrink(usable, &choice)) continue;
    if (usable) {
      summary->calibration.findings.push_back(
          Finding(
              FindingCode::kChoiceNotMade,
              Format("`auto`: %.0f residual degrees of freedom are too few to compare models; the "
                     "largest model that the poses determine was taken, without higher terms",
                     quality.dof))
              .With("degrees_of_freedom", quality.dof));
    }
    return summary;
  }
  const std::string missing = models.Missing(choice);
  Candidates candidates(models, choice, options.cross_validation_folds, std::move(settled));
  std::vector<ModelAlternative> steps = {
      Described(models.DescriptionOf(choice), &candidates.FitOf(choice), std::nullopt, candidates)};
  for (int i = 0; i < kMostSteps; ++i) {
    auto step = Improve(models, &candidates, &choice);
    if (!step) break;
    steps.push_back(*std::move(step));
  }
  Result<CalibrationSummary> summary = calibrate(models.OptionsOf(choice), nullptr);
  if (!summary) return summary;
  if (!missing.empty()) {
    summary->calibration.findings.emplace_back(
        FindingCode::kTermsNotWeighed,
        "`auto`: these terms were not tested, since the poses do not determine them or leave too "
        "few degrees of freedom: " +
            missing);
  }
  summary->calibration.quality.rests.model_steps = std::move(steps);
  summary->calibration.quality.rests.model_choice = AlternativesTo(models, choice, &candidates);
  return summary;
}

}  // namespace truetriad
