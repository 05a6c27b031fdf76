// SPDX-License-Identifier: Apache-2.0
#include "estimation/noise_settling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <glog/logging.h>

#include "truetriad/math/distributions.h"

namespace truetriad {
namespace {

constexpr int kMaxNoiseRounds = 15;
constexpr int kReadmittingRounds = 5;
// Mean change of the weights below which they have settled.
constexpr double kSettledWeight = 1e-3;
// Relative change of an excess variance below which it has settled.
constexpr double kSettledExcess = 1e-4;
// Share of false alarms, over all poses and sensors of a run, at which a pose is left out.
constexpr double kRejectionLevel = 0.01;
// A rejected observation keeps this weight: nothing against the rest (an error of 1000 σ moves the
// fit by 1e-5 σ), but its pose stays determined.
constexpr double kRejectedWeight = 1e-8;
// Fewer residual degrees of freedom than this cannot tell a bad pose from a good one.
constexpr int kMinRobustDof = 6;
// An estimated excess with fewer degrees of freedom than this is not an estimate.
constexpr double kLeastExcessDof = 0.5;
// Share of the field strength that an unknown noise starts from.
constexpr double kFirstNoiseShare = 1e-3;
// Numerical floor of an estimated noise, as a share of the field strength.
constexpr double kNoiseFloorShare = 1e-12;

double ShareOfField(double share, Triad triad, const PoseGraph& graph) {
  const double sigma = share * WorldVector(triad, graph.reference()).norm();
  return sigma * sigma;
}

// Without rest noise the excess is all the noise there is, and exact data would drive it to zero.
ExcessVariance ExcessFloor(const NoiseState& noise, const PoseGraph& graph) {
  ExcessVariance floor{};
  for (const Triad triad : noise.estimated) {
    if (noise.source[triad] != NoiseSource::kResidual) continue;
    floor[triad] = ShareOfField(kNoiseFloorShare, triad, graph);
  }
  return floor;
}

void Estimate(NoiseState* noise, PoseGraph* graph) {
  ReducedSystem system(*graph);
  noise->estimate =
      EstimateExcess(noise->estimated, noise->excess, ExcessFloor(*noise, *graph), graph, &system);
  noise->excess = noise->estimate.variance;
}

// Residuals that other unknowns can explain as well (the tilt of a six-face block, say) hold no
// information on the excess: its estimate would be noise, and so would every σ made from it.
void DropExcessThatIsNotSeen(NoiseState* noise, PoseGraph* graph, Messages* messages) {
  std::vector<Triad> seen;
  for (const Triad triad : noise->estimated) {
    const double dof = ExcessDegreesOfFreedom(noise->estimate, *graph, triad);
    if (dof >= kLeastExcessDof || noise->source[triad] == NoiseSource::kResidual) {
      seen.push_back(triad);
      continue;
    }
    noise->excess[triad] = 0.0;
    messages->push_back(
        std::string(TriadName(triad)) +
        ": these poses hold no information on pose-to-pose noise; σ rests on the noise inside "
        "rests alone (state `noise: { excess: { sigma: … } }` if you know it)");
  }
  if (seen.size() == noise->estimated.size()) return;
  noise->estimated = std::move(seen);
  ApplyExcess(noise->excess, graph);
  noise->estimate = ExcessEstimate{};
  if (!noise->estimated.empty()) Estimate(noise, graph);
}

// First guess of each excess: what makes the median deletion test match its χ². Half of the poses
// may be disturbed without moving it much.
void GuessExcessFromMedians(NoiseState* noise, PoseGraph* graph) {
  const ReducedSystem system(*graph);
  const std::vector<DeletionTest> tests = DeletionTests(*graph, system);
  const ExcessVariance floor = ExcessFloor(*noise, *graph);
  for (const Triad triad : noise->estimated) {
    std::vector<double> ratios;
    const Eigen::Matrix3d correction = graph->sensitivity(triad).inverse();
    double rest = 0.0;
    for (const DeletionTest& test : tests) {
      const Observation& observation = graph->nodes[test.node].observations[test.observation];
      if (observation.triad != triad || test.rank == 0) continue;
      ratios.push_back(test.chi2 / ChiSquareQuantile(0.5, test.rank));
      rest += (correction * observation.rest_covariance * correction.transpose()).trace() / 3.0;
    }
    if (ratios.empty()) continue;
    rest /= static_cast<double>(ratios.size());
    noise->excess[triad] =
        std::max(Median(ratios) * (rest + noise->excess[triad]) - rest, floor[triad]);
  }
  ApplyExcess(noise->excess, graph);
}

// Huber weights from the deletion tests; observations whose test cannot be chance are rejected.
// Returns whether the rejected set or a weight changed notably. `may_readmit`: a rejected
// observation whose test has become good again returns.
bool UpdateWeights(const RobustOptions& robust,
                   const NoiseState& noise,
                   bool may_readmit,
                   PoseGraph* graph) {
  const ReducedSystem system(*graph);
  const std::vector<DeletionTest> tests = DeletionTests(*graph, system);
  const double level =
      kRejectionLevel / static_cast<double>(std::max<std::size_t>(tests.size(), 1));
  // A weight that starts at `scale` normal σ must start at the same probability for any rank.
  std::array<double, 4> huber_limit{};
  // A scale whose tail a double cannot hold is as good as no loss at all.
  const double inside = std::min(ChiSquareCdf(robust.scale * robust.scale, 1.0), 1.0 - 1e-12);
  for (int rank = 1; rank <= 3 && inside > 0.0; ++rank) {
    huber_limit[static_cast<std::size_t>(rank)] = std::sqrt(ChiSquareQuantile(inside, rank));
  }
  PerTriad<double> dof{{std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::infinity()}};
  for (const Triad triad : noise.estimated) {
    if (!noise.estimate.triads.empty()) {
      const double found = ExcessDegreesOfFreedom(noise.estimate, *graph, triad);
      dof[triad] = found > 1.0 ? found : 1.0;
    }
  }

  bool changed = false;
  double moved = 0.0;
  std::size_t t = 0;
  for (std::size_t k = 0; k < graph->nodes.size(); ++k) {
    PoseNode& node = graph->nodes[k];
    const std::size_t first = t;
    // At one pose the triads share the blame for their disagreement: only the worst goes, and the
    // others are judged again without it.
    std::size_t worst = first;
    double worst_ratio = -1.0;
    bool has_rejected = false;
    for (; t < tests.size() && tests[t].node == k; ++t) {
      has_rejected = has_rejected || node.observations[tests[t].observation].rejected;
      const double ratio = tests[t].rank > 0 ? tests[t].chi2 / tests[t].rank : 0.0;
      if (ratio > worst_ratio) {
        worst_ratio = ratio;
        worst = t;
      }
    }
    for (std::size_t i = first; i < t; ++i) {
      Observation& observation = node.observations[tests[i].observation];
      double weight = 1.0;
      bool rejected = false;
      if (tests[i].rank > 0) {
        const double z = std::sqrt(tests[i].chi2);
        const double limit = huber_limit[static_cast<std::size_t>(tests[i].rank)];
        if (z > limit) weight = limit / z;
        const double nu = dof[observation.triad];
        const double p = std::isfinite(nu)
                             ? 1.0 - FisherCdf(tests[i].chi2 / tests[i].rank, tests[i].rank, nu)
                             : 1.0 - ChiSquareCdf(tests[i].chi2, tests[i].rank);
        rejected = p < level && (observation.rejected || (!has_rejected && i == worst));
      } else {
        rejected = observation.rejected;
      }
      rejected = rejected || (observation.rejected && !may_readmit);
      if (rejected) weight = kRejectedWeight;
      changed = changed || rejected != observation.rejected;
      moved += std::abs(weight - observation.weight);
      observation.rejected = rejected;
      observation.weight = weight;
    }
  }
  return changed || moved > kSettledWeight * static_cast<double>(tests.size());
}

}  // namespace

NoiseState ChooseNoise(const PoseSet& poses, const CalibrateOptions& options, Messages* messages) {
  NoiseState noise;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled) continue;
    int seen = 0;
    int with_covariance = 0;
    for (const StaticPose& pose : poses.poses) {
      if (!pose.triads[triad]) continue;
      ++seen;
      if (pose.triads[triad]->has_covariance) ++with_covariance;
    }
    const bool all_have_covariance = with_covariance == seen;
    const bool stated = sensor.noise_sigma_raw || sensor.allan;
    if (!all_have_covariance && with_covariance > 0 && !stated) {
      messages->push_back(
          std::string(TriadName(triad)) + ": " + std::to_string(seen - with_covariance) + " of " +
          std::to_string(seen) +
          " poses state no sigma; those of the others are not used, noise comes from the "
          "residuals");
    }
    if (sensor.noise_sigma_raw) {
      noise.source[triad] = sensor.noise_source;
    } else if (sensor.allan) {
      noise.source[triad] = NoiseSource::kAllan;
    } else {
      noise.source[triad] = all_have_covariance ? NoiseSource::kStatic : NoiseSource::kResidual;
    }
    if (noise.source[triad] == NoiseSource::kResidual || sensor.excess == ExcessNoise::kEstimate) {
      noise.estimated.push_back(triad);
    } else if (sensor.excess == ExcessNoise::kGiven) {
      noise.excess[triad] = sensor.excess_sigma * sensor.excess_sigma;
    }
  }
  return noise;
}

void StartNoise(NoiseState* noise, PoseGraph* graph) {
  for (const Triad triad : noise->estimated) {
    if (noise->source[triad] != NoiseSource::kResidual) continue;
    noise->excess[triad] = ShareOfField(kFirstNoiseShare, triad, *graph);
  }
  ApplyExcess(noise->excess, graph);
}

void SolveLog::Solve(double tolerance, PoseGraph* graph) {
  const SolveOutcome outcome = SolveGraph(graph, tolerance);
  VLOG(1) << outcome.iterations << " iterations, cost " << outcome.initial_cost << " -> "
          << outcome.final_cost;
  if (initial_cost < 0.0) initial_cost = outcome.initial_cost;
  iterations += outcome.iterations;
  final_cost = outcome.final_cost;
  converged = outcome.converged;
}

double ResidualDof(const PoseGraph& graph, const ReducedSystem& system) {
  double dof = static_cast<double>(graph.priors.size()) - system.rank();
  for (const PoseNode& node : graph.nodes) {
    dof += node.row_count() - node.tangent_size();
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      // A rejected triad takes its rows along; a rotation that loses it keeps only a direction.
      dof -= node.kind == PoseKind::kRotation && !node.has_attitude_prior ? 2 : 3;
      if (node.kind == PoseKind::kDirection) dof += 2;
    }
  }
  return dof;
}

int SettleNoise(const RobustOptions& robust,
                NoiseState* noise,
                PoseGraph* graph,
                SolveLog* log,
                Messages* messages) {
  const double dof = ResidualDof(*graph, ReducedSystem(*graph));
  const bool weighs = robust.enabled && dof >= kMinRobustDof;
  if (robust.enabled && !weighs) {
    messages->push_back(
        Format("few residual degrees of freedom (%.0f): a disturbed pose could not be told from a "
               "good one, none was looked for",
               dof));
  }
  if (dof < 1.0) {
    if (!noise->estimated.empty()) {
      messages->emplace_back(
          "no residual degrees of freedom: pose-to-pose noise could not be estimated, σ rests on "
          "the noise inside rests alone");
    }
    for (const Triad triad : noise->estimated) {
      noise->unknown = noise->unknown || noise->source[triad] == NoiseSource::kResidual;
      if (noise->source[triad] != NoiseSource::kResidual) noise->excess[triad] = 0.0;
    }
    noise->estimated.clear();
  }
  if (!weighs && noise->estimated.empty()) {
    ApplyExcess(noise->excess, graph);
    log->Solve(kFinalTolerance, graph);
    return 0;
  }
  if (weighs) GuessExcessFromMedians(noise, graph);
  int rounds = 0;
  for (int round = 0; round < kMaxNoiseRounds; ++round) {
    ++rounds;
    // Late in the day borderline observations could come and go for ever.
    const bool weights_changed =
        weighs && UpdateWeights(robust, *noise, round < kReadmittingRounds, graph);
    log->Solve(kRoundTolerance, graph);
    // A direction that nothing determines: more rounds would only creep along it.
    if (!log->converged) return rounds;
    const ExcessVariance before = noise->excess;
    if (!noise->estimated.empty()) {
      Estimate(noise, graph);
      DropExcessThatIsNotSeen(noise, graph, messages);
    }
    bool excess_changed = false;
    for (const Triad triad : noise->estimated) {
      excess_changed = excess_changed || std::abs(noise->excess[triad] - before[triad]) >
                                             kSettledExcess * noise->excess[triad];
    }
    if (!weights_changed && !excess_changed) break;
  }
  log->Solve(kFinalTolerance, graph);
  return rounds;
}

}  // namespace truetriad
