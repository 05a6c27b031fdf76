// SPDX-License-Identifier: Apache-2.0
#include "estimation/model_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "estimation/graph_builder.h"
#include "estimation/messages.h"
#include "estimation/quality.h"
#include "truetriad/math/distributions.h"

namespace truetriad {
namespace {

// Share of terms that are not there and yet would stay by the likelihood ratio alone.
constexpr double kLevel = 0.01;
// Higher terms are weighed only where as many residual degrees of freedom are left beside them, and
// nothing at all where the matrices alone leave fewer: no ratio would be too large for chance, and
// a model that is too small is wrong without saying so, one that is too large has large σ.
constexpr double kLeastDof = 10.0;
// Far more than there are terms: a choice that goes round in circles ends somewhere.
constexpr int kMostSteps = 32;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What may be there or not, beyond the matrix.
struct HigherTerm {
  Wanted TriadOptions::*wanted;
  const char* name;
};
// In the order in which they go when the poses do not determine them all.
constexpr std::array<HigherTerm, 3> kHigherTerms = {{
    {&TriadOptions::quadratic, "quadratic term"},
    {&TriadOptions::asymmetry, "asymmetry"},
    {&TriadOptions::g_sensitivity, "g-sensitivity"},
}};

// A choice that was made: models and terms, none of them open.
using Choice = CalibrateOptions;

// The matrix models of a triad that differ, smallest first; one when nothing is open.
std::vector<MatrixModel> MatrixModels(const CalibrateOptions& wanted, Triad triad) {
  const TriadOptions& sensor = wanted.triads[triad];
  if (sensor.model != MatrixModel::kAuto) return {sensor.model};
  if (sensor.fixed_sensitivity) return {MatrixModel::kFull};
  std::vector<MatrixModel> models;
  if (sensor.nominal_sensitivity) models.push_back(MatrixModel::kBias);
  models.push_back(MatrixModel::kDiagonal);
  const bool frame_is_free = wanted.attitudes.kind == AttitudeKind::kNone;
  if (triad != LeadingTriad(wanted) || !frame_is_free) models.push_back(MatrixModel::kSymmetric);
  models.push_back(MatrixModel::kFull);
  return models;
}

void SetMatrixModel(const CalibrateOptions& wanted,
                    Triad triad,
                    MatrixModel model,
                    Choice* choice) {
  TriadOptions& sensor = choice->triads[triad];
  sensor.model = model;
  sensor.fixed_sensitivity = wanted.triads[triad].fixed_sensitivity;
  if (model == MatrixModel::kBias && !sensor.fixed_sensitivity) {
    sensor.fixed_sensitivity = sensor.nominal_sensitivity;
  }
}

Choice LargestModel(const CalibrateOptions& wanted) {
  Choice choice = wanted;
  for (const Triad triad : kTriads) {
    SetMatrixModel(wanted, triad, MatrixModels(wanted, triad).back(), &choice);
    for (const HigherTerm& term : kHigherTerms) {
      Wanted& value = choice.triads[triad].*term.wanted;
      if (value == Wanted::kAuto) value = Wanted::kYes;
    }
  }
  return choice;
}

// A model that differs by one term.
struct Neighbour {
  Choice choice;
  std::string description;
  bool is_larger = false;
};

std::vector<Neighbour> NeighboursOf(const CalibrateOptions& wanted, const Choice& choice) {
  std::vector<Neighbour> neighbours;
  for (const Triad triad : kTriads) {
    if (!wanted.triads[triad].enabled) continue;
    const std::string name(TriadName(triad));
    const std::vector<MatrixModel> models = MatrixModels(wanted, triad);
    const auto at = std::find(models.begin(), models.end(), choice.triads[triad].model);
    for (const auto other : {at - 1, at + 1}) {
      if (other < models.begin() || other >= models.end()) continue;
      Neighbour& neighbour = neighbours.emplace_back();
      neighbour.choice = choice;
      SetMatrixModel(wanted, triad, *other, &neighbour.choice);
      neighbour.description = name + " " + std::string(MatrixModelName(*other));
      neighbour.is_larger = other > at;
    }
    for (const HigherTerm& term : kHigherTerms) {
      if (wanted.triads[triad].*term.wanted != Wanted::kAuto) continue;
      Neighbour& neighbour = neighbours.emplace_back();
      neighbour.choice = choice;
      Wanted& value = neighbour.choice.triads[triad].*term.wanted;
      neighbour.is_larger = value == Wanted::kNo;
      value = neighbour.is_larger ? Wanted::kYes : Wanted::kNo;
      neighbour.description = name + (neighbour.is_larger ? " with " : " without ") + term.name;
    }
  }
  return neighbours;
}

// "accelerometer full; gyroscope full, g-sensitivity": what was open, as it was chosen.
std::string DescriptionOf(const CalibrateOptions& wanted, const Choice& choice) {
  std::string text;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = wanted.triads[triad];
    std::string terms;
    for (const HigherTerm& term : kHigherTerms) {
      if (choice.triads[triad].*term.wanted == Wanted::kYes) terms += std::string(", ") + term.name;
    }
    const bool is_open = sensor.model == MatrixModel::kAuto ||
                         std::any_of(kHigherTerms.begin(), kHigherTerms.end(), [&](const auto& t) {
                           return sensor.*t.wanted == Wanted::kAuto;
                         });
    if (!sensor.enabled || !is_open) continue;
    if (!text.empty()) text += "; ";
    text.append(TriadName(triad)).append(" ");
    text.append(MatrixModelName(choice.triads[triad].model)).append(terms);
  }
  return text;
}

// One solution with the noise and the weights of the largest model.
struct Fit {
  PoseGraph graph;
  double chi2 = kInfinity;
  std::optional<std::optional<double>> held_out;  // set once it was asked for
  int parameters() const { return graph.layout.free_size(); }
};

// The places in `larger` of the entries of `smaller`, by name; -1 where there is none.
std::vector<int> PlacesIn(const SharedLayout& larger, const SharedLayout& smaller) {
  const std::vector<std::string> names = ParameterNames(larger);
  std::vector<int> places;
  for (const std::string& name : ParameterNames(smaller)) {
    const auto found = std::find(names.begin(), names.end(), name);
    places.push_back(found == names.end() ? -1 : static_cast<int>(found - names.begin()));
  }
  return places;
}

// The graph of a smaller model, at that point of it which is nearest to the larger one's optimum.
PoseGraph Restricted(const PoseGraph& larger, const Choice& choice) {
  StartValues start;
  start.reference = larger.reference();
  for (const Triad triad : kTriads) {
    if (!larger.layout.Has(triad)) continue;
    const std::optional<Eigen::Matrix3d>& held = choice.triads[triad].fixed_sensitivity;
    start.models[triad] = {held ? *held : Eigen::Matrix3d(larger.sensitivity(triad)),
                           larger.bias(triad)};
  }
  PoseGraph graph = larger;
  LayOutParameters(choice, start, &graph);
  graph.nodes = larger.nodes;  // with the attitudes that they have
  const std::vector<int> places = PlacesIn(larger.layout, graph.layout);
  for (std::size_t i = 0; i < places.size(); ++i) {
    graph.shared[static_cast<Eigen::Index>(i)] = larger.shared[places[i]];
  }
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    const int at = graph.layout.sensitivity[triad];
    Eigen::VectorXd entries = start.models[triad]->sensitivity.reshaped();
    if (!choice.triads[triad].fixed_sensitivity) {
      const Eigen::MatrixXd basis = graph.layout.basis.middleRows<9>(at);
      entries = basis * (basis.transpose() * entries);
    }
    graph.shared.segment<9>(at) = entries;
  }
  for (IncrementEdge& edge : graph.increments) edge.Integrate(graph.layout, graph.shared.data());
  AddPriors(choice, &graph);
  return graph;
}

// Directions of the larger model's free coordinates, at its optimum, that the smaller one lacks.
Eigen::MatrixXd TestedDirections(const PoseGraph& larger, const PoseGraph& smaller) {
  const SharedLayout& layout = larger.layout;
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(layout.size, smaller.layout.free_size());
  const std::vector<int> places = PlacesIn(layout, smaller.layout);
  for (std::size_t i = 0; i < places.size(); ++i) {
    moved.row(places[i]) = smaller.layout.basis.row(static_cast<Eigen::Index>(i));
  }
  // Where the larger model holds the strength of the field, another strength is another scale of
  // the magnetometer.
  const int field = layout.reference + kField;
  if (!layout.IsFree(field) && layout.Has(Triad::kMagnetometer)) {
    const Eigen::RowVectorXd strength = moved.row(field) / larger.reference()[kField];
    moved.middleRows<9>(layout.sensitivity[Triad::kMagnetometer]) +=
        larger.sensitivity(Triad::kMagnetometer).reshaped() * strength;
  }
  const Eigen::MatrixXd kept = layout.basis.transpose() * moved;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(kept);
  const Eigen::MatrixXd all = qr.householderQ();
  return all.rightCols(all.cols() - qr.rank());
}

// Everything that candidates are compared by.
class Candidates {
 public:
  Candidates(const CalibrateOptions& wanted, const Choice& largest, SettledModel settled)
      : wanted_(wanted), largest_choice_(largest), noise_(std::move(settled.noise)) {
    for (const PoseNode& node : settled.graph.nodes) {
      for (const Observation& seen : node.observations) rows_ += seen.rejected ? 0 : 3;
    }
    for (const IncrementEdge& edge : settled.graph.increments) rows_ += edge.rejected ? 0 : 3;
    largest_ = settled.graph;
    Fit& fit = fits_[DescriptionOf(wanted_, largest)];
    fit.graph = std::move(settled.graph);
    Solve(&fit);
  }

  // Whether it is part of the largest model.
  bool Holds(const Choice& choice) const {
    for (const Triad triad : kTriads) {
      const TriadOptions& sensor = choice.triads[triad];
      const TriadOptions& most = largest_choice_.triads[triad];
      if (sensor.model > most.model) return false;
      for (const HigherTerm& term : kHigherTerms) {
        if (sensor.*term.wanted == Wanted::kYes && most.*term.wanted != Wanted::kYes) return false;
      }
    }
    return true;
  }

  Fit& FitOf(const Choice& choice) {
    const auto [found, is_new] = fits_.try_emplace(DescriptionOf(wanted_, choice));
    if (is_new) {
      found->second.graph = Restricted(largest_, choice);
      Solve(&found->second);
    }
    return found->second;
  }

  double BicOf(const Fit& fit) const {
    return fit.chi2 + fit.parameters() * std::log(static_cast<double>(rows_));
  }

  const std::optional<double>& HeldOutOf(Fit* fit) const {
    if (!fit->held_out) fit->held_out = HeldOutError(fit->graph, wanted_.cross_validation_folds);
    return *fit->held_out;
  }

  // Probability of the likelihood ratio of two nested models.
  double PValue(const Fit& larger, const Fit& smaller) const {
    const Eigen::MatrixXd tested = TestedDirections(larger.graph, smaller.graph);
    const double count = static_cast<double>(tested.cols());
    const double ratio = std::max(smaller.chi2 - larger.chi2, 0.0);
    if (count < 1.0) return 1.0;
    if (!std::isfinite(ratio)) return 0.0;
    const JointTest test =
        KenwardRogerTest(noise_.estimate, ReducedSystem(larger.graph), larger.graph, tested);
    return 1.0 - FisherCdf(test.scale * ratio / count, count, test.dof);
  }

  // Whether all three say that the larger of two models is worth its parameters.
  bool IsWorthIt(Fit* larger, Fit* smaller, double p_value) const {
    if (p_value >= kLevel || BicOf(*larger) >= BicOf(*smaller)) return false;
    const std::optional<double>& with = HeldOutOf(larger);
    const std::optional<double>& without = HeldOutOf(smaller);
    return !with || !without || *with < *without;
  }

 private:
  // A fit that does not converge is none.
  static void Solve(Fit* fit) {
    const SolveOutcome outcome = SolveGraph(&fit->graph);
    if (outcome.converged && std::isfinite(outcome.final_cost))
      fit->chi2 = 2.0 * outcome.final_cost;
  }

  const CalibrateOptions& wanted_;
  Choice largest_choice_;
  NoiseState noise_;
  PoseGraph largest_;
  int rows_ = 0;
  std::map<std::string, Fit> fits_;  // by description; nodes of a map stay where they are
};

// One step: takes away the term that is worth least, else adds the one that is worth most. False
// where neither changes the choice.
bool Improve(const CalibrateOptions& wanted, Candidates* candidates, Choice* choice) {
  Fit& present = candidates->FitOf(*choice);
  const std::vector<Neighbour> neighbours = NeighboursOf(wanted, *choice);
  const Neighbour* worst = nullptr;
  double largest_p = -1.0;
  for (const Neighbour& neighbour : neighbours) {
    if (neighbour.is_larger) continue;
    Fit& smaller = candidates->FitOf(neighbour.choice);
    const double p = candidates->PValue(present, smaller);
    if (p <= largest_p || candidates->IsWorthIt(&present, &smaller, p)) continue;
    largest_p = p;
    worst = &neighbour;
  }
  const Neighbour* best = nullptr;
  double smallest_p = kInfinity;
  for (const Neighbour& neighbour : neighbours) {
    if (worst != nullptr || !neighbour.is_larger || !candidates->Holds(neighbour.choice)) continue;
    Fit& larger = candidates->FitOf(neighbour.choice);
    const double p = candidates->PValue(larger, present);
    if (p >= smallest_p || !candidates->IsWorthIt(&larger, &present, p)) continue;
    smallest_p = p;
    best = &neighbour;
  }
  if (worst == nullptr && best == nullptr) return false;
  *choice = (worst != nullptr ? worst : best)->choice;
  return true;
}

// The chosen model, then those that differ from it by one step.
std::vector<ModelAlternative> AlternativesTo(const CalibrateOptions& wanted,
                                             const Choice& choice,
                                             Candidates* candidates) {
  std::vector<ModelAlternative> alternatives;
  const auto add = [&](const std::string& description, Fit* fit) -> ModelAlternative& {
    ModelAlternative& alternative = alternatives.emplace_back();
    alternative.description = description;
    alternative.parameters = fit->parameters();
    alternative.minus_2_log_l = fit->chi2;
    alternative.bic = candidates->BicOf(*fit);
    alternative.held_out = candidates->HeldOutOf(fit);
    return alternative;
  };
  Fit& chosen = candidates->FitOf(choice);
  add(DescriptionOf(wanted, choice), &chosen).chosen = true;
  for (const Neighbour& neighbour : NeighboursOf(wanted, choice)) {
    if (!candidates->Holds(neighbour.choice)) continue;
    Fit& fit = candidates->FitOf(neighbour.choice);
    add(neighbour.description, &fit).p_value =
        neighbour.is_larger ? candidates->PValue(fit, chosen) : candidates->PValue(chosen, fit);
  }
  return alternatives;
}

// Takes away what the poses may not determine: one term, or a step of a matrix. False where nothing
// is left to take.
bool Shrink(const CalibrateOptions& wanted, bool higher_terms_only, Choice* choice) {
  for (const HigherTerm& term : kHigherTerms) {
    for (const Triad triad : kTriads) {
      if (wanted.triads[triad].*term.wanted != Wanted::kAuto) continue;
      Wanted& value = choice->triads[triad].*term.wanted;
      if (value == Wanted::kNo) continue;
      value = Wanted::kNo;
      return true;
    }
  }
  if (higher_terms_only) return false;
  for (const Triad triad : {Triad::kGyroscope, Triad::kMagnetometer, Triad::kAccelerometer}) {
    if (!wanted.triads[triad].enabled) continue;
    const std::vector<MatrixModel> models = MatrixModels(wanted, triad);
    const auto at = std::find(models.begin(), models.end(), choice->triads[triad].model);
    if (at == models.begin()) continue;
    SetMatrixModel(wanted, triad, *(at - 1), choice);
    return true;
  }
  return false;
}

}  // namespace

Result<CalibrationSummary> CalibrateWithChoice(const CalibrateOptions& options,
                                               const CalibrateOnce& calibrate) {
  Choice choice = LargestModel(options);
  SettledModel settled;
  for (;;) {
    Result<CalibrationSummary> summary = calibrate(choice, &settled);
    if (!summary || options.initialise.only) return summary;
    const bool usable = summary->calibration.IsUsable();
    const bool few = summary->calibration.quality.dof < kLeastDof;
    if (usable && !few) break;
    if (Shrink(options, usable, &choice)) continue;
    if (usable) {
      summary->calibration.messages.push_back(Format(
          "`auto`: %.0f residual degrees of freedom are too few to weigh models; the largest "
          "that the poses determine was taken, without higher terms",
          summary->calibration.quality.dof));
    }
    return summary;
  }
  Candidates candidates(options, choice, std::move(settled));
  for (int step = 0; step < kMostSteps && Improve(options, &candidates, &choice); ++step) {
  }
  Result<CalibrationSummary> summary = calibrate(choice, nullptr);
  if (!summary) return summary;
  summary->calibration.quality.model_choice = AlternativesTo(options, choice, &candidates);
  return summary;
}

}  // namespace truetriad
