// SPDX-License-Identifier: Apache-2.0
#include "verdict/left_out_terms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "problem/graph_builder.h"
#include "solve/linearised_graph.h"
#include "verdict/checks/constancy.h"
#include "verdict/observability.h"
#include "verdict/own_residuals.h"
#include "verdict/settling.h"

namespace truetriad {
namespace {

// Of what an entry would be known to if all else were known: less is not seen apart from the rest.
constexpr double kSeenApart = 1e-6;
// A direction of a term that shows is off by so many σ.
constexpr double kShownSigmas = 3.0;
// Rows that tell of a low-pass.
constexpr std::size_t kFewestTurned = 100;
// Poses in a row that tell of a drift.
constexpr std::size_t kFewestInARow = 8;

double LevelOf(const std::optional<double>& kappa) {
  return kappa && *kappa > 1.0 ? kMovingLevel : kLeftOutLevel;
}

// A term and its free coordinates in the larger model.
struct Candidate {
  LeftOutTerm term;
  std::vector<Eigen::Index> columns;
  std::size_t number = 0;  // among all
  double level = kLeftOutLevel;
};

constexpr std::array<std::pair<Triad, AxisTerm>, 6> kBends = {
    {{Triad::kAccelerometer, AxisTerm::kQuadratic},
     {Triad::kAccelerometer, AxisTerm::kCubic},
     {Triad::kGyroscope, AxisTerm::kAsymmetry},
     {Triad::kGyroscope, AxisTerm::kCubic},
     {Triad::kMagnetometer, AxisTerm::kQuadratic},
     {Triad::kMagnetometer, AxisTerm::kCubic}}};

// From -1 to 1 over the run; unset where poses are too few to tell of a drift.
std::optional<std::vector<double>> TimesOf(const PoseGraph& graph) {
  if (graph.nodes.size() < kFewestInARow) return std::nullopt;
  const auto [first, last] = std::minmax_element(
      graph.nodes.begin(), graph.nodes.end(), [](const PoseNode& a, const PoseNode& b) {
        return a.time_s < b.time_s;
      });
  const double begin_s = first->time_s, duration_s = last->time_s - begin_s;
  if (!(duration_s > 0.0)) return std::nullopt;
  std::vector<double> times;
  for (const PoseNode& node : graph.nodes) {
    times.push_back(2.0 * (node.time_s - begin_s) / duration_s - 1.0);
  }
  return times;
}

// Of rows of a sensor that is turned about, as its own readings show its rate; unset where nodes
// are no such rows. A first-order low-pass of time constant t leaves (1 - (t w)^2) of what turns at
// the rate w.
std::optional<std::vector<double>> SquaredRatesOf(const PoseGraph& graph) {
  const std::size_t count = graph.nodes.size();
  if (count < kFewestTurned) return std::nullopt;
  std::vector<Eigen::Vector3d> directions;
  for (const PoseNode& node : graph.nodes) {
    if (node.kind != PoseKind::kDirection) return std::nullopt;
    const Observation& seen = node.observations.front();
    const TriadModel<double> model{graph.sensitivity(seen.triad), graph.bias(seen.triad)};
    directions.push_back(model.TruthFromRaw(seen.mean_raw).normalized());
  }
  std::vector<double> squared;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t before = k == 0 ? 0 : k - 1, after = std::min(k + 1, count - 1);
    const double step_s = graph.nodes[after].time_s - graph.nodes[before].time_s;
    if (!(step_s > 0.0)) return std::nullopt;
    squared.push_back((directions[after] - directions[before]).squaredNorm() / (step_s * step_s));
  }
  return squared;
}

// With something else in the place of temperature: temperature terms are then those of it.
PoseGraph WithForTemperature(const std::vector<double>& values, PoseGraph graph) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    graph.nodes[k].temperature_degc = values[k];
    graph.nodes[k].temperature_rate_degcps = 0.0;
  }
  for (IncrementEdge& edge : graph.increments) {
    edge.temperature_degc = 0.5 * (values[edge.from] + values[edge.from + 1]);
    edge.temperature_rate_degcps = 0.0;
  }
  return graph;
}

// The options with all that may have been left out.
CalibrateOptions WithEverything(const CalibrateOptions& stated,
                                const SharedLayout& has,
                                bool drifts) {
  CalibrateOptions options = WithLeftOutBends(stated, has);
  if (has.Has(Triad::kGyroscope) && has.Has(Triad::kAccelerometer)) {
    options.triads[Triad::kGyroscope].g_sensitivity = Wanted::kYes;
  }
  if (!drifts) return options;
  options.reference.temperature_degc = 0.0;
  for (const Triad triad : kTriads) {
    if (!has.Has(triad)) continue;
    options.triads[triad].thermal.bias_order = 1;
    options.triads[triad].thermal.matrix_order = 1;
    options.triads[triad].thermal.matrix = ThermalMatrix::kDiagonal;
  }
  return options;
}

std::vector<Candidate> CandidatesOf(const SharedLayout& whole, const SharedLayout& has) {
  std::vector<Candidate> candidates;
  const auto add = [&](Triad triad, LeftOutKind kind, AxisTerm term, int at, int size) {
    candidates.push_back({{triad, kind, term}, whole.ColumnsOf(at, size)});
  };
  for (const Triad triad : kTriads) {
    for (const auto& [term, at] : whole.axis_terms[triad]) {
      const auto& known = has.axis_terms[triad];
      const bool is_known = std::any_of(
          known.begin(), known.end(), [&](const auto& block) { return block.term == term; });
      if (!is_known) add(triad, LeftOutKind::kAxisTerm, term, at, 3);
    }
    const ThermalBlock& thermal = whole.thermal[triad];
    if (!whole.Has(triad) || thermal.size() == 0 || has.thermal[triad].size() > 0) continue;
    if (thermal.vector_count() > 0) add(triad, LeftOutKind::kDrift, {}, thermal.vector_at(0), 3);
    add(triad, LeftOutKind::kGainDrift, {}, thermal.matrix_at(0), 9);
  }
  if (whole.g_sensitivity >= 0 && has.g_sensitivity < 0) {
    add(Triad::kGyroscope, LeftOutKind::kGSensitivity, {}, whole.g_sensitivity, 9);
  }
  return candidates;
}

// Where each free coordinate of `has` stands among those of `whole`; unset where one is missing.
std::optional<std::vector<Eigen::Index>> CommonColumns(const SharedLayout& whole,
                                                       const SharedLayout& has) {
  const std::vector<int> places = PlacesIn(has, whole);
  std::vector<Eigen::Index> columns;
  for (Eigen::Index own = 0; own < has.basis.cols(); ++own) {
    Eigen::VectorXd lifted = Eigen::VectorXd::Zero(whole.size);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i] >= 0) lifted[static_cast<Eigen::Index>(i)] = has.basis(places[i], own);
    }
    Eigen::Index best = 0;
    const double share = (whole.basis.transpose() * lifted).cwiseAbs().maxCoeff(&best);
    if (share < 0.99) return std::nullopt;
    columns.push_back(best);
  }
  return columns;
}

// Information and gradient of the terms, given the solution's own coordinates at their best.
struct Conditional {
  Eigen::MatrixXd information;  // I
  Eigen::VectorXd gradient;     // u
  Eigen::MatrixXd gain;         // M_bb^-1 M_bh
  Eigen::VectorXd full;         // of each entry if all else were known
};

std::optional<Conditional> ConditionOn(const Eigen::MatrixXd& information,
                                       const Eigen::VectorXd& gradient,
                                       const std::vector<Eigen::Index>& base,
                                       const std::vector<Eigen::Index>& extra) {
  const Eigen::VectorXd scale = information.diagonal()(base).cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::MatrixXd across = information(base, extra);
  const Cholesky factor(scale.asDiagonal() * information(base, base) * scale.asDiagonal());
  if (!factor.is_positive()) return std::nullopt;
  Conditional given;
  given.gain = scale.asDiagonal() * factor.Solve(scale.asDiagonal() * across);
  given.information = information(extra, extra) - TransposeTimes(across, given.gain);
  given.gradient = gradient(extra) - given.gain.transpose() * gradient(base);
  given.full = information.diagonal()(extra);
  return given;
}

// The test of the entries `at` of what is left.
struct ScoreTest {
  double chi2 = 0.0;
  int rank = 0;
};

class TermSearch {
 public:
  explicit TermSearch(Conditional given)
      : given_(std::move(given)), information_(given_.information), gradient_(given_.gradient) {}

  ScoreTest Test(const std::vector<Eigen::Index>& at) const {
    const std::vector<Eigen::Index> seen = SeenOf(at);
    ScoreTest test;
    if (seen.empty()) return test;
    const Cholesky factor(information_(seen, seen));
    if (!factor.is_positive()) return test;
    test.chi2 = gradient_(seen).dot(factor.SolveVector(gradient_(seen)));
    test.rank = static_cast<int>(seen.size());
    return test;
  }

  // By how many σ some parameter moves at most when h moves by one of its own: h^T I h = 1.
  std::optional<double> KappaOf(const std::vector<Eigen::Index>& at,
                                const SharedLayout& layout,
                                const Eigen::ArrayXd& variances) const {
    const std::vector<Eigen::Index> seen = SeenOf(at);
    if (seen.size() < at.size()) return std::nullopt;
    const Cholesky factor(information_(seen, seen));
    if (!factor.is_positive()) return std::nullopt;
    const Eigen::MatrixXd moved =
        layout.basis * given_.gain(Eigen::all, seen) * factor.Root().transpose().inverse();
    return std::sqrt((variances > 0.0)
                         .select(moved.rowwise().squaredNorm().array() / variances, 0.0)
                         .maxCoeff());
  }

  // |h| of them.
  double SizeOf(const std::vector<Eigen::Index>& at) const {
    const std::vector<Eigen::Index> seen = SeenOf(at);
    return Cholesky(information_(seen, seen)).SolveVector(gradient_(seen)).norm();
  }

  // The others are tested beside it from now on. Of its directions those are taken in that show:
  // what does not would only add what it is unknown by. `variance`: of the noise without it.
  // Returns how they move the solution.
  Eigen::VectorXd TakeIn(const std::vector<Eigen::Index>& at, double variance) {
    const Directions directions = DirectionsOf(SeenOf(at), variance);
    const Eigen::MatrixXd& shown = directions.shown;
    const Eigen::MatrixXd across = Times(information_, shown);
    const Cholesky factor(TransposeTimes(shown, across));
    const Eigen::VectorXd step = factor.SolveVector(shown.transpose() * gradient_);
    gradient_ -= across * step;
    information_ -= Times(across, factor.Solve(across.transpose()));
    // Those that do not show are as large as those that do, as far as the readings allow it: axes
    // of one sensor are of one make.
    const double size2 = (shown * step).squaredNorm() / static_cast<double>(shown.cols());
    Append(shown, Eigen::MatrixXd::Zero(shown.cols(), shown.cols()));
    Append(directions.hidden, TransposeTimes(directions.hidden, directions.hidden) / size2);
    return given_.gain * (shown * step);
  }

  // d d^T + V of all that was taken in.
  Eigen::MatrixXd Covariance() const {
    const Eigen::MatrixXd gain = Times(given_.gain, taken_);
    const Cholesky factor(TransposedCongruence(taken_, given_.information) + prior_);
    const Eigen::VectorXd moved = gain * factor.SolveVector(taken_.transpose() * given_.gradient);
    return moved * moved.transpose() + Times(gain, factor.Solve(gain.transpose()));
  }
  bool is_empty() const { return taken_.cols() == 0; }

 private:
  std::vector<Eigen::Index> SeenOf(const std::vector<Eigen::Index>& at) const {
    std::vector<Eigen::Index> seen;
    for (const Eigen::Index i : at) {
      if (information_(i, i) > kSeenApart * given_.full[i]) seen.push_back(i);
    }
    return seen;
  }

  struct Directions {
    Eigen::MatrixXd shown, hidden;  // one a column
  };
  // Of some entries, each scaled by what it would be known to: shown are those that are off by so
  // many σ, the clearest in any case.
  Directions DirectionsOf(const std::vector<Eigen::Index>& at, double variance) const {
    const Eigen::VectorXd scale = given_.full(at).cwiseSqrt().cwiseInverse();
    const SymmetricEigen spectrum =
        EigenOfSymmetric(scale.asDiagonal() * information_(at, at) * scale.asDiagonal());
    const Eigen::VectorXd along =
        TransposeTimesVector(spectrum.vectors, scale.cwiseProduct(gradient_(at)));
    const Eigen::VectorXd z2 = along.cwiseAbs2().cwiseQuotient(spectrum.values.cwiseMax(1e-300));
    const double least = std::min(kShownSigmas * kShownSigmas * variance, z2.maxCoeff());
    Directions directions{Eigen::MatrixXd(information_.rows(), 0),
                          Eigen::MatrixXd(information_.rows(), 0)};
    for (Eigen::Index i = 0; i < z2.size(); ++i) {
      Eigen::MatrixXd& into = z2[i] < least ? directions.hidden : directions.shown;
      into.conservativeResize(Eigen::NoChange, into.cols() + 1);
      into.rightCols(1).setZero();
      for (std::size_t k = 0; k < at.size(); ++k) {
        const auto entry = static_cast<Eigen::Index>(k);
        into(at[k], into.cols() - 1) = scale[entry] * spectrum.vectors(entry, i);
      }
    }
    return directions;
  }

  void Append(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& prior) {
    const Eigen::Index before = taken_.cols(), more = directions.cols();
    taken_.conservativeResize(information_.rows(), before + more);
    taken_.rightCols(more) = directions;
    prior_.conservativeResizeLike(Eigen::MatrixXd::Zero(before + more, before + more));
    prior_.bottomRightCorner(more, more) = prior;
  }

  Conditional given_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd taken_;  // a direction a column
  Eigen::MatrixXd prior_;  // information about their sizes that the readings do not give
};

// The terms that `larger` has and the graph has not, of which information and gradient tell.
LeftOutTerms SearchTerms(const PoseGraph& graph,
                         const Eigen::MatrixXd& covariance,
                         const SharedLayout& larger,
                         const Eigen::MatrixXd& information,
                         const Eigen::VectorXd& gradient,
                         PerTriad<OwnResiduals> own,
                         const std::vector<ProbedTerm>& probed = {}) {
  LeftOutTerms result;
  result.covariance = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  const auto base = CommonColumns(larger, graph.layout);
  if (!base) return result;
  std::vector<Candidate> candidates = CandidatesOf(larger, graph.layout);
  for (const ProbedTerm& probe : probed) {
    candidates.push_back({probe.term, larger.ColumnsOf(probe.block.offset, probe.block.size)});
  }
  std::vector<Eigen::Index> extra;
  for (Candidate& candidate : candidates) {
    candidate.number = static_cast<std::size_t>(&candidate - candidates.data());
    for (Eigen::Index& column : candidate.columns) {
      extra.push_back(column);
      column = static_cast<Eigen::Index>(extra.size()) - 1;
    }
  }
  auto given = ConditionOn(information, gradient, *base, extra);
  if (!given) return result;
  TermSearch search(*std::move(given));
  const Eigen::ArrayXd variances = VariancesOf(graph.layout, covariance);
  for (Candidate& candidate : candidates) {
    const auto kappa = search.KappaOf(candidate.columns, graph.layout, variances);
    candidate.level = LevelOf(kappa);
    result.tests.push_back(
        {candidate.term.triad, std::string(NameOf(candidate.term)), 1.0, false, kappa});
  }
  while (!candidates.empty()) {
    std::vector<ScoreTest> tests;
    for (Candidate& candidate : candidates) {
      const ScoreTest& test = tests.emplace_back(search.Test(candidate.columns));
      candidate.term.p_value = own[candidate.term.triad].ChanceOf(test.chi2, test.rank);
      result.tests[candidate.number].p_value = candidate.term.p_value;
    }
    // The most of χ² a degree of freedom where chances are too small for a double.
    const auto is_less_clear = [&](std::size_t a, std::size_t b) {
      const double pa = candidates[a].term.p_value / candidates[a].level;
      const double pb = candidates[b].term.p_value / candidates[b].level;
      return pa != pb ? pa > pb : tests[a].chi2 < tests[b].chi2;
    };
    std::size_t clearest = 0;
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      if (is_less_clear(clearest, i)) clearest = i;
    }
    LeftOutTerm& term = candidates[clearest].term;
    if (term.p_value > candidates[clearest].level) break;
    term.size = search.SizeOf(candidates[clearest].columns);
    OwnResiduals& rest = own[term.triad];
    const double variance = rest.VarianceWithout(tests[clearest].chi2, tests[clearest].rank);
    rest.dof -= tests[clearest].rank;
    rest.chi2 = std::max(rest.chi2 - tests[clearest].chi2, 0.0);
    term.effect_sigmas =
        LargestInSigmas(graph, covariance, search.TakeIn(candidates[clearest].columns, variance));
    result.tests[candidates[clearest].number].is_shown = true;
    result.found.push_back(term);
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(clearest));
  }
  if (!search.is_empty()) result.covariance = search.Covariance();
  return result;
}

void AddLowPass(const PoseGraph& graph,
                const ReducedSystem& system,
                CalibrateOptions options,
                const PerTriad<OwnResiduals>& own,
                LeftOutTerms* terms) {
  const auto squared_rates = options.HasThermal() ? std::nullopt : SquaredRatesOf(graph);
  if (!squared_rates) return;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    options.triads[triad].thermal.matrix_order = 1;
    options.triads[triad].thermal.matrix = ThermalMatrix::kScale;
  }
  options.reference.temperature_degc = 0.0;
  const PoseGraph larger = WithTermsOf(options, WithForTemperature(*squared_rates, graph));
  LinearisedGraph whole(larger);
  whole.Eliminate(larger);
  const LeftOutTerms found =
      SearchTerms(graph, system.covariance(), larger.layout, whole.matrix(), whole.gradient(), own);
  terms->covariance += found.covariance;
  for (LeftOutTerm term : found.found) {
    term.kind = LeftOutKind::kLowPass;
    terms->found.push_back(term);
  }
}

}  // namespace

std::string_view NameOf(const LeftOutTerm& term) {
  switch (term.kind) {
    case LeftOutKind::kAxisTerm:
      return InfoOf(term.axis_term).name;
    case LeftOutKind::kGSensitivity:
      return "g_sensitivity";
    case LeftOutKind::kDrift:
      return "bias drift";
    case LeftOutKind::kGainDrift:
      return "gain drift";
    case LeftOutKind::kLowPass:
      return "low-pass";
    case LeftOutKind::kLeverArm:
      return "lever arm";
    case LeftOutKind::kSettling:
      return "settling";
    case LeftOutKind::kStep:
    case LeftOutKind::kOneSided:
    case LeftOutKind::kLostRows:
    case LeftOutKind::kRounding:
    case LeftOutKind::kTurnScatter:
      break;
  }
  return "";
}

CalibrateOptions WithLeftOutBends(const CalibrateOptions& stated, const SharedLayout& has) {
  CalibrateOptions options = stated;
  for (const auto& [triad, term] : kBends) {
    if (has.Has(triad)) options.triads[triad].axis_terms[term] = Wanted::kYes;
  }
  return options;
}

LeftOutTerms FindLeftOutTerms(const PoseGraph& graph,
                              const Eigen::MatrixXd& covariance,
                              const SharedLayout& larger,
                              const std::vector<ProbedTerm>& probed,
                              const Eigen::MatrixXd& information,
                              const Eigen::VectorXd& gradient) {
  return SearchTerms(graph, covariance, larger, information, gradient, {}, probed);
}

LeftOutTerms FindLeftOutTerms(const PoseGraph& graph,
                              const ReducedSystem& system,
                              const NoiseState& noise,
                              const CalibrateOptions& options,
                              bool is_change_known) {
  LeftOutTerms result;
  result.covariance = Eigen::MatrixXd::Zero(system.size(), system.size());
  if (noise.unknown || system.rank() < system.size() || system.size() == 0) return result;
  const auto times = options.HasThermal() ? std::nullopt : TimesOf(graph);
  const PoseGraph larger = WithTermsOf(WithEverything(options, graph.layout, times.has_value()),
                                       times ? WithForTemperature(*times, graph) : graph);
  LinearisedGraph whole(larger);
  whole.Eliminate(larger);
  PerTriad<OwnResiduals> own;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    own[triad] = OwnResidualsOf(graph, system, noise, triad, kLeftOutLevel);
  }
  result =
      SearchTerms(graph, system.covariance(), larger.layout, whole.matrix(), whole.gradient(), own);
  AddLowPass(graph, system, options, own, &result);
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad) || (triad == Triad::kMagnetometer && is_change_known)) continue;
    const auto step = FindBiasStep(graph, system, own[triad], triad);
    if (!step || step->p_value > kLeftOutLevel) continue;
    result.covariance += step->moved * step->moved.transpose();
    LeftOutTerm term{triad, LeftOutKind::kStep};
    term.p_value = step->p_value;
    term.effect_sigmas = step->effect_sigmas;
    term.pose = graph.nodes[step->node].number;
    result.found.push_back(term);
  }
  return result;
}

void AddSettling(const PoseSet& poses,
                 const PoseGraph& graph,
                 const ReducedSystem& system,
                 const NoiseState& noise,
                 LeftOutTerms* terms) {
  if (noise.unknown || system.rank() < system.size() || system.size() == 0) return;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    const auto settling =
        triad == Triad::kGyroscope
            ? FindUnsettledTurns(poses, graph, system)
            : FindSettling(
                  graph, system, OwnResidualsOf(graph, system, noise, triad, kLeftOutLevel), triad);
    if (!settling) continue;
    LeftOutTerm term{triad, LeftOutKind::kSettling};
    term.p_value = settling->p_value;
    term.effect_sigmas = settling->effect_sigmas;
    const bool is_shown = term.p_value < LevelOf(settling->kappa);
    terms->tests.push_back(
        {triad, std::string(NameOf(term)), term.p_value, is_shown, settling->kappa});
    if (!is_shown) continue;
    terms->covariance += settling->moved * settling->moved.transpose() + settling->covariance;
    terms->found.push_back(term);
  }
}

}  // namespace truetriad
