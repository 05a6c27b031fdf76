// SPDX-License-Identifier: Apache-2.0
#include "verdict/left_out_terms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/graph_builder.h"
#include "solve/shared_information.h"
#include "verdict/term_search.h"

namespace truetriad {
namespace {

// A term that moves so many σ for each of its own is told from the model by next to nothing: what
// linearisation leaves is as large.
constexpr double kUnseenKappa = 20.0;

double LevelOf(const std::optional<double>& kappa) {
  return kappa && *kappa > 1.0 ? kMovingLevel : kLeftOutLevel;
}

double ChanceOf(double chi2, int rank) { return rank > 0 ? 1.0 - ChiSquareCdf(chi2, rank) : 1.0; }

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

// `base`: where the columns of `has` stand among those of `whole`. `drifts`: what stands in the
// place of temperature is something else.
std::vector<Candidate> CandidatesOf(const SharedLayout& whole,
                                    const SharedLayout& has,
                                    bool drifts,
                                    const std::vector<Eigen::Index>& base) {
  std::vector<Candidate> candidates;
  int matrices = 0;
  Candidate all{{Triad::kAccelerometer, LeftOutKind::kMatrix}, {}};
  const auto add = [&](Triad triad, LeftOutKind kind, AxisTerm term, int at, int size) {
    candidates.push_back({{triad, kind, term}, whole.ColumnsOf(at, size)});
  };
  for (const Triad triad : kTriads) {
    if (!whole.Has(triad)) continue;
    Candidate matrix{{triad, LeftOutKind::kMatrix}, {}};
    for (const Eigen::Index column : whole.ColumnsOf(whole.sensitivity[triad], 9)) {
      if (std::find(base.begin(), base.end(), column) == base.end()) {
        matrix.columns.push_back(column);
      }
    }
    // Three gains, or none, leave the other entries out; between, some are tied to others.
    matrix.term.is_tied =
        matrix.columns.size() == 3 && has.ColumnsOf(has.sensitivity[triad], 9).size() > 3;
    if (!matrix.columns.empty()) {
      all.term.triad = triad;
      all.term.is_tied = all.term.is_tied || matrix.term.is_tied;
      ++matrices;
      all.columns.insert(all.columns.end(), matrix.columns.begin(), matrix.columns.end());
      candidates.push_back(std::move(matrix));
    }
    for (const auto& [term, at] : whole.axis_terms[triad]) {
      const auto& known = has.axis_terms[triad];
      const bool is_known =
          std::any_of(known.begin(), known.end(), [&term = term](const auto& block) {
            return block.term == term;
          });
      if (!is_known) add(triad, LeftOutKind::kAxisTerm, term, at, 3);
    }
    const ThermalBlock& thermal = whole.thermal[triad];
    const int known = has.thermal[triad].terms.matrix_order;
    if (thermal.terms.matrix_order == known) continue;
    if (drifts && thermal.vector_count() > 0) {
      add(triad, LeftOutKind::kDrift, {}, thermal.vector_at(0), 3);
    }
    add(triad,
        drifts ? LeftOutKind::kGainDrift : LeftOutKind::kThermalGain,
        {},
        thermal.matrix_at(known),
        9);
  }
  if (matrices > 1) {
    all.term.is_shared = true;
    candidates.push_back(std::move(all));
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

bool IsStated(const Candidate& candidate, const CalibrateOptions& options) {
  return candidate.term.kind == LeftOutKind::kAxisTerm &&
         options.triads[candidate.term.triad].nonlinearity.has_value();
}

// Of what the data sheets let bend, by each sensor how much less certain that makes the solution.
void AllowForStated(const PoseGraph& graph,
                    const Eigen::MatrixXd& covariance,
                    const CalibrateOptions& options,
                    const std::vector<Candidate>& candidates,
                    TermSearch* search,
                    LeftOutTerms* result) {
  PerTriad<std::vector<Eigen::Index>> entries;
  std::vector<Eigen::Index> all;
  std::vector<double> sigmas;
  for (const Candidate& candidate : candidates) {
    const Triad triad = candidate.term.triad;
    if (!IsStated(candidate, options) || !Acts(Mechanism::kStatedBends)) continue;
    const Eigen::Vector3d gains = graph.sensitivity(triad).rowwise().norm();
    for (std::size_t axis = 0; axis < candidate.columns.size(); ++axis) {
      entries[triad].push_back(candidate.columns[axis]);
      all.push_back(candidate.columns[axis]);
      sigmas.push_back(options.triads[triad].nonlinearity->SigmaOf(
          InfoOf(candidate.term.axis_term), gains[static_cast<Eigen::Index>(axis)]));
    }
  }
  search->AllowFor(all, Eigen::VectorXd::Map(sigmas.data(), std::ssize(sigmas)));
  const Eigen::ArrayXd before = VariancesOf(graph.layout, covariance);
  for (const Triad triad : kTriads) {
    if (entries[triad].empty()) continue;
    const Eigen::ArrayXd more = VariancesOf(graph.layout, search->CovarianceBy(entries[triad]));
    const double most = (before > 0.0).select(more / before, 0.0).maxCoeff();
    result->stated.push_back({triad, *options.triads[triad].nonlinearity, std::sqrt(1.0 + most)});
  }
}

// Of the candidates that were not taken in, those that move much and may be there.
void AddDoubtful(const PoseGraph& graph,
                 const Eigen::MatrixXd& covariance,
                 const TermSearch& search,
                 const std::vector<Candidate>& candidates,
                 LeftOutTerms* result) {
  const Eigen::MatrixXd known = result->covariance;
  const Eigen::ArrayXd variances = VariancesOf(graph.layout, covariance);
  for (const Candidate& candidate : candidates) {
    if (candidate.level < kMovingLevel || candidate.term.p_value > kDoubtLevel) continue;
    if (!Acts(Mechanism::kDoubt)) continue;
    TermSearch with = search;
    LeftOutTerm& term = result->doubtful.emplace_back(candidate.term);
    term.effect_sigmas = LargestInSigmas(graph.layout, covariance, with.TakeIn(candidate.columns));
    const Eigen::MatrixXd more = with.Covariance() - known;
    const double most =
        (variances > 0.0).select(VariancesOf(graph.layout, more) / variances, 0.0).maxCoeff();
    result->covariance += std::min(1.0, (kMostByDoubt * kMostByDoubt - 1.0) / most) * more;
  }
}

// The terms that `larger` has and the graph has not, of which information and gradient tell.
LeftOutTerms SearchTerms(const PoseGraph& graph,
                         Eigen::MatrixXd covariance,
                         const CalibrateOptions& options,
                         const SharedLayout& larger,
                         const Eigen::MatrixXd& information,
                         const Eigen::VectorXd& gradient,
                         const std::vector<ProbedTerm>& probed) {
  LeftOutTerms result;
  result.covariance = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  const auto base = CommonColumns(larger, graph.layout);
  if (!base) return result;
  std::vector<Candidate> candidates =
      CandidatesOf(larger, graph.layout, !options.HasThermal(), *base);
  for (const ProbedTerm& probe : probed) {
    candidates.push_back({probe.term, larger.ColumnsOf(probe.block.offset, probe.block.size)});
  }
  std::vector<Eigen::Index> extra;
  for (Candidate& candidate : candidates) {
    candidate.number = static_cast<std::size_t>(&candidate - candidates.data());
    for (Eigen::Index& column : candidate.columns) {
      // What several matrices lack together they lack one by one as well.
      const auto place = std::find(extra.begin(), extra.end(), column) - extra.begin();
      if (place == std::ssize(extra)) extra.push_back(column);
      column = place;
    }
  }
  auto given = ConditionOn(information, gradient, *base, extra);
  if (!given) return result;
  TermSearch search(*std::move(given));
  AllowForStated(graph, covariance, options, candidates, &search, &result);
  if (!search.is_empty()) covariance += search.Covariance();
  const Eigen::ArrayXd variances = VariancesOf(graph.layout, covariance);
  for (Candidate& candidate : candidates) {
    auto kappa = search.KappaOf(candidate.columns, graph.layout, variances);
    if (kappa && *kappa > kUnseenKappa) {
      kappa.reset();
      candidate.columns.clear();
    }
    candidate.level = LevelOf(kappa);
    result.tests.push_back(
        {candidate.term.triad, std::string(NameOf(candidate.term)), 1.0, false, kappa});
  }
  std::erase_if(candidates, [](const Candidate& candidate) { return candidate.columns.empty(); });
  while (!candidates.empty()) {
    std::vector<ScoreTest> tests;
    for (Candidate& candidate : candidates) {
      const ScoreTest& test = tests.emplace_back(search.Test(candidate.columns));
      candidate.term.p_value = ChanceOf(test.chi2, test.rank);
      result.tests[candidate.number].p_value = candidate.term.p_value;
    }
    // A matrix that was cut short by its `model:` explains before anything else; the most of χ² a
    // degree of freedom where chances are too small for a double.
    const auto is_held = [&](std::size_t i) {
      return candidates[i].term.kind == LeftOutKind::kMatrix &&
             candidates[i].term.p_value < candidates[i].level;
    };
    const auto is_less_clear = [&](std::size_t a, std::size_t b) {
      if (is_held(a) != is_held(b)) return is_held(b);
      const double pa = candidates[a].term.p_value / candidates[a].level;
      const double pb = candidates[b].term.p_value / candidates[b].level;
      return pa != pb ? pa > pb : tests[a].chi2 < tests[b].chi2;
    };
    std::size_t clearest = 0;
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      if (is_less_clear(clearest, i)) clearest = i;
    }
    LeftOutTerm& term = candidates[clearest].term;
    term.is_beyond_stated = IsStated(candidates[clearest], options);
    if (term.p_value > candidates[clearest].level) break;
    if (!Acts(ActsAs(term))) {
      candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(clearest));
      continue;
    }
    term.chi2 = tests[clearest].chi2;
    term.size = search.SizeOf(candidates[clearest].columns);
    if (term.kind == LeftOutKind::kDrift) {
      // From -1 to 1 over the run.
      term.size *= 2.0 / std::cbrt(std::abs(graph.sensitivity(term.triad).determinant()));
    }
    term.effect_sigmas =
        LargestInSigmas(graph.layout, covariance, search.TakeIn(candidates[clearest].columns));
    result.tests[candidates[clearest].number].is_shown = true;
    result.found.push_back(term);
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(clearest));
  }
  if (!search.is_empty()) result.covariance = search.Covariance();
  AddDoubtful(graph, covariance, search, candidates, &result);
  return result;
}

}  // namespace

std::string_view NameOf(const LeftOutTerm& term) {
  switch (term.kind) {
    case LeftOutKind::kAxisTerm:
      return InfoOf(term.axis_term).name;
    case LeftOutKind::kMatrix:
      return "matrix";
    case LeftOutKind::kGSensitivity:
      return "g_sensitivity";
    case LeftOutKind::kDrift:
      return "bias drift";
    case LeftOutKind::kGainDrift:
      return "gain drift";
    case LeftOutKind::kThermalGain:
      return "matrix over temperature";
    case LeftOutKind::kLowPass:
      return "low-pass";
    case LeftOutKind::kLeverArm:
      return "lever arm";
    case LeftOutKind::kOneSided:
    case LeftOutKind::kLostRows:
    case LeftOutKind::kRounding:
    case LeftOutKind::kTurnScatter:
      break;
    case LeftOutKind::kSettling:
      return "settling";
  }
  return "";
}

Mechanism ActsAs(const LeftOutTerm& term) {
  switch (term.kind) {
    case LeftOutKind::kAxisTerm:
      return Mechanism::kBend;
    case LeftOutKind::kMatrix:
      return Mechanism::kMatrix;
    case LeftOutKind::kGSensitivity:
      return Mechanism::kGSensitivity;
    case LeftOutKind::kDrift:
      return Mechanism::kDrift;
    case LeftOutKind::kGainDrift:
      return Mechanism::kGainDrift;
    case LeftOutKind::kThermalGain:
    case LeftOutKind::kLowPass:
      return Mechanism::kThermalGain;
    case LeftOutKind::kLeverArm:
      return Mechanism::kLeverArm;
    case LeftOutKind::kOneSided:
      return Mechanism::kOneSided;
    case LeftOutKind::kLostRows:
      return Mechanism::kLostRows;
    case LeftOutKind::kRounding:
      return Mechanism::kRounding;
    case LeftOutKind::kTurnScatter:
      return Mechanism::kTurnScatter;
    case LeftOutKind::kSettling:
      return Mechanism::kSettlingTurns;
  }
  return Mechanism::kBend;
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
                              const CalibrateOptions& options,
                              const SharedLayout& larger,
                              const std::vector<ProbedTerm>& probed,
                              const Eigen::MatrixXd& information,
                              const Eigen::VectorXd& gradient) {
  return SearchTerms(graph, covariance, options, larger, information, gradient, probed);
}

}  // namespace truetriad
