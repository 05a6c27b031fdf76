// SPDX-License-Identifier: Apache-2.0
#include "noise/noise_settling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <glog/logging.h>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "noise/weights.h"
#include "problem/graph_builder.h"
#include "solve/solve_graph.h"

namespace truetriad {
namespace {

// Chosen: the most rounds in a pass. If the noise has not settled by then, a last solution ends the
// pass.
constexpr int kMaxNoiseRounds = 15;
// The largest number of passes. Before each pass, the turns are integrated again. A second pass is
// rarely needed, a third hardly ever.
constexpr int kMostNoisePasses = 3;
// If the σ of a turn is larger than this (11 degrees), the turn determines nothing, for any sensor
// that is worth calibrating.
constexpr double kSaysNothingRad = 0.2;
// From this round on, rejected observations stay rejected, so that the rounds come to an end.
constexpr int kReadmittingRounds = 5;
// If a step changes the parameters by less than this χ² (0.1 σ), no further step is needed.
constexpr double kSmallStepChi2 = 0.01;
// If the cost falls by less than this share of the predicted decrease, the problem is too
// nonlinear, and the step is undone.
constexpr double kKeptPromise = 0.5;
// Rounding error of a sum of 1e6 squares: 1e6 times 1e-16.
constexpr double kCostRounding = 1e-10;
// Chosen: if the steps are not small by then, SolveGraph takes over.
constexpr int kMostSteps = 4;
// An excess has settled if it changes by less than this share of the whole variance, 0.05 % of σ.
constexpr double kSettledExcess = 1e-3;
// With fewer residual degrees of freedom a bad pose cannot be distinguished from a good one.
constexpr int kMinRobustDof = 6;
// With fewer degrees of freedom the σ of an estimated excess is over twice its value.
constexpr double kLeastExcessDof = 0.5;
// σ with which an unknown noise starts, as a share of the component's typical signal.
constexpr double kFirstNoiseShare = 1e-3;

// Variance of a noise whose σ is this share of a component's typical signal.
double ShareOfSignal(double share, NoiseComponent component, const PoseGraph& graph) {
  const std::optional<Triad> triad = TriadOf(component);
  const bool is_field = triad && *triad != Triad::kGyroscope;
  const double sigma = share * (is_field ? WorldVector(*triad, graph.reference()).norm() : 1.0);
  return sigma * sigma;
}

// The least excess of each component. It is above zero if there is no rest noise: the excess is
// then the whole noise, which exact data would make zero.
ExcessVariance ExcessFloor(const NoiseState& noise, const PoseGraph& graph) {
  ExcessVariance floor{};
  for (const NoiseComponent component : noise.estimated) {
    if (!noise.IsFromResiduals(component)) continue;
    floor[component] = ShareOfSignal(kLeastNoiseShare, component, graph);
  }
  return floor;
}

// Estimates the excess. `system` belongs to the graph; on return, it has the estimated variances.
void Estimate(NoiseState* noise, PoseGraph* graph, ReducedSystem* system) {
  noise->estimate = EstimateExcess(
      noise->estimated, noise->estimate, noise->excess, ExcessFloor(*noise, *graph), graph, system);
  noise->excess = noise->estimate.variance;
}

// Whether the residuals contain information on a component's excess.
bool IsSeen(const NoiseState& noise, const PoseGraph& graph, NoiseComponent component) {
  return ExcessDegreesOfFreedom(noise.estimate, graph, component) >= kLeastExcessDof;
}

// The undetermined component with the fewest degrees of freedom.
std::optional<NoiseComponent> LeastSeen(const NoiseState& noise, const PoseGraph& graph) {
  std::optional<NoiseComponent> least;
  double least_dof = std::numeric_limits<double>::infinity();
  for (const NoiseComponent component : noise.estimated) {
    if (IsSeen(noise, graph, component)) continue;
    const double dof = ExcessDegreesOfFreedom(noise.estimate, graph, component);
    if (least && !(dof < least_dof)) continue;
    least = component;
    least_dof = dof;
  }
  return least;
}

// If other unknowns (the tilt of a six-face block, say) explain the residuals as well as an excess
// does, the estimate of this excess would be arbitrary, and all σ with it. Such components are
// dropped one by one: if only the sum of two is determined, dropping one determines the other.
void DropExcessThatIsNotSeen(NoiseState* noise,
                             PoseGraph* graph,
                             ReducedSystem* system,
                             Findings* findings) {
  while (const auto unseen = LeastSeen(*noise, *graph)) {
    if (!Acts(Mechanism::kUnseenNoise)) break;
    std::erase(noise->estimated, *unseen);
    if (noise->IsFromResiduals(*unseen)) {
      noise->unknown = true;
      noise->estimate = ExcessEstimate{};
      continue;
    }
    noise->excess[*unseen] = 0.0;
    Finding& finding = findings->emplace_back(
        FindingCode::kExcessUnknown,
        NoiseComponentName(*unseen) +
            ": these poses hold no information on pose-to-pose noise; σ include only the noise "
            "within rests",
        "state " +
            SensorLine(TriadOf(*unseen).value_or(Triad::kGyroscope),
                       "noise: { excess: { sigma: … } }") +
            " if you know it");
    finding.sensor = TriadOf(*unseen);
    // If the poses' estimated noise hides the turns' noise, the turns' noise hardly matters.
    if (*unseen == NoiseComponent::kTurn && !noise->estimated.empty()) finding.As(Severity::kNote);
    ApplyExcess(noise->excess, graph);
    system->Eliminate(*graph);
    noise->estimate = ExcessEstimate{};
    if (!noise->estimated.empty()) Estimate(noise, graph, system);
  }
}

// The first guess of each excess: the value for which the median of the deletion tests equals the
// median of χ². Even if almost half of the poses are disturbed, the guess changes little.
void GuessExcessFromMedians(NoiseState* noise, PoseGraph* graph, ReducedSystem* system) {
  const std::vector<DeletionTest> tests = DeletionTests(*graph, *system);
  const ExcessVariance floor = ExcessFloor(*noise, *graph);
  for (const NoiseComponent component : noise->estimated) {
    std::vector<double> ratios;
    for (const DeletionTest& test : tests) {
      if (test.component != component || test.rank == 0 || IsStated(test, *graph)) continue;
      ratios.push_back(test.chi2 / ChiSquareQuantile(0.5, test.rank));
    }
    if (ratios.empty()) continue;
    const double known = MeanKnownVariance(*graph, component);
    noise->excess[component] =
        std::max(Median(ratios) * (known + noise->excess[component]) - known, floor[component]);
  }
  ApplyExcess(noise->excess, graph);
  system->Eliminate(*graph);
}

bool HasRejected(NoiseComponent component, const PoseGraph& graph) {
  if (component == NoiseComponent::kTurn) {
    return std::any_of(graph.increments.begin(),
                       graph.increments.end(),
                       [](const IncrementEdge& edge) { return edge.rejected; });
  }
  return std::any_of(graph.nodes.begin(), graph.nodes.end(), [&](const PoseNode& node) {
    return std::any_of(
        node.observations.begin(), node.observations.end(), [&](const Observation& seen) {
          return seen.rejected && ComponentOf(node, seen) == component;
        });
  });
}

// If the excess of a component is not determined without its rejected observations, these were
// rejected with a noise that is unknown. They are then accepted again, and the component is not
// tested any more. Returns whether there was such a component.
bool ReadmitWhatCannotBeJudged(const NoiseState& noise,
                               const PoseGraph& graph,
                               UnknownNoise* unknown) {
  bool readmits = false;
  for (const NoiseComponent component : noise.estimated) {
    if (IsSeen(noise, graph, component) || !HasRejected(component, graph)) continue;
    if (Contains(unknown->unjudged, component) || !Acts(Mechanism::kReadmitted)) continue;
    unknown->unjudged.push_back(component);
    readmits = true;
  }
  return readmits;
}

// Takes Gauss-Newton steps until they are small; `system` belongs to the graph before and after the
// steps. If a step cannot be taken or does not lower the cost as predicted, or if steps stay large,
// restores the graph, but not `system`, and returns false. The optimiser always computes the last
// solution.
bool TakeSteps(PoseGraph* graph, ReducedSystem* system) {
  const Eigen::VectorXd shared_before = graph->shared;
  std::vector<PoseValues> states_before;
  states_before.reserve(graph->nodes.size());
  for (const PoseNode& node : graph->nodes) states_before.push_back(node.state);
  for (int i = 0; i < kMostSteps; ++i) {
    const double chi2 = system->step().dot(system->information() * system->step());
    if (!std::isfinite(chi2) || system->rank() < system->size()) break;
    const double cost = system->cost();
    system->TakeStep(system->step(), graph);
    system->Linearise(*graph);
    const double rounding = kCostRounding * cost;
    if (!(cost - system->cost() > kKeptPromise * 0.5 * chi2 - rounding)) break;
    if (chi2 < kSmallStepChi2) return true;
  }
  graph->shared = shared_before;
  for (std::size_t k = 0; k < states_before.size(); ++k) graph->nodes[k].state = states_before[k];
  return false;
}

// Repeats the robust step (unless `robust` is null), the solution and the estimate of the excess
// until nothing changes. Returns false if the solution does not converge: more rounds would only
// creep along an undetermined direction.
bool TakeRounds(const RobustOptions* robust,
                NoiseState* noise,
                UnknownNoise* unknown,
                PoseGraph* graph,
                ReducedSystem* system,
                SolveLog* log,
                Findings* findings,
                int* rounds) {
  for (int round = 0; round < kMaxNoiseRounds; ++round) {
    ++*rounds;
    // In later rounds, rejected observations are not accepted again: borderline ones could come and
    // go for ever.
    WeightChange weights;
    if (robust != nullptr) {
      const bool may_readmit = round < kReadmittingRounds;
      weights = UpdateWeights(*robust, *noise, *unknown, *system, may_readmit, graph);
    }
    if (weights.any) system->Eliminate(*graph);
    if (!TakeSteps(graph, system)) {
      log->Solve(kRoundTolerance, graph);
      if (!log->converged) return false;
      ApplyExcess(noise->excess, graph);
      system->Linearise(*graph);
    }
    const ExcessVariance before = noise->excess;
    if (!noise->estimated.empty()) {
      Estimate(noise, graph, system);
      if (robust != nullptr && ReadmitWhatCannotBeJudged(*noise, *graph, unknown)) continue;
      DropExcessThatIsNotSeen(noise, graph, system, findings);
    }
    bool excess_changed = false;
    for (const NoiseComponent component : noise->estimated) {
      const double total = noise->excess[component] + MeanKnownVariance(*graph, component);
      excess_changed = excess_changed || std::abs(noise->excess[component] - before[component]) >
                                             kSettledExcess * total;
    }
    if (!weights.notable && !excess_changed) break;
  }
  return true;
}

}  // namespace

NoiseState ChooseNoise(const PoseSet& poses, const CalibrateOptions& options, Findings* findings) {
  NoiseState noise;
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled) continue;
    int seen = 0;
    int with_covariance = 0;
    const auto count = [&](const StaticPose& pose) {
      if (!pose.triads[triad]) return;
      ++seen;
      if (pose.triads[triad]->has_covariance) ++with_covariance;
    };
    for (const StaticPose& pose : poses.poses) count(pose);
    for (const KnownRate& rate : poses.rates) {
      if (triad == Triad::kGyroscope) count(rate.means);
    }
    const bool all_have_covariance = with_covariance == seen;
    const bool stated = sensor.noise_sigma_raw || sensor.allan;
    if (!all_have_covariance && with_covariance > 0 && !stated) {
      findings->push_back(
          Finding(FindingCode::kSigmaPartlyStated,
                  std::string(TriadName(triad)) + ": " + std::to_string(seen - with_covariance) +
                      " of " + std::to_string(seen) +
                      " poses state no sigma; the sigmas of the others are not used, and the noise "
                      "is estimated from the residuals")
              .About(triad)
              .With("without_sigma", seen - with_covariance)
              .With("poses", seen));
    }
    if (sensor.noise_sigma_raw) {
      noise.source[triad] = sensor.noise_source;
    } else if (sensor.allan) {
      noise.source[triad] = NoiseSource::kAllan;
    } else {
      noise.source[triad] = all_have_covariance ? NoiseSource::kStatic : NoiseSource::kResidual;
    }
    if (noise.source[triad] == NoiseSource::kResidual || sensor.excess == ExcessNoise::kEstimate) {
      noise.estimated.push_back(PoseNoise(triad));
      if (triad != Triad::kGyroscope) continue;
      if (!poses.rates.empty()) noise.estimated.push_back(NoiseComponent::kRate);
      if (!poses.moves.empty() && !options.HasGyroscopeAlone()) {
        noise.estimated.push_back(NoiseComponent::kTurn);
      }
    } else if (sensor.excess == ExcessNoise::kGiven) {
      noise.excess[triad] = sensor.excess_sigma * sensor.excess_sigma;
    }
  }
  return noise;
}

void StartNoise(NoiseState* noise, PoseGraph* graph) {
  for (const NoiseComponent component : noise->estimated) {
    if (!noise->IsFromResiduals(component)) continue;
    noise->excess[component] = ShareOfSignal(kFirstNoiseShare, component, *graph);
  }
  ApplyExcess(noise->excess, graph);
}

void WeighReadingsAtStart(const RobustOptions& robust, PoseGraph* graph) {
  if (!robust.enabled) return;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!graph->layout.Has(triad)) continue;
    const double field = WorldVector(triad, graph->reference()).norm();
    std::vector<Observation*> observations;
    std::vector<double> errors;
    for (PoseNode& node : graph->nodes) {
      for (Observation& observation : node.observations) {
        if (observation.triad != triad) continue;
        const double length = graph->ModelAt(triad, node).TruthFromRaw(observation.mean_raw).norm();
        observations.push_back(&observation);
        errors.push_back(std::abs(length / field - 1.0));
      }
    }
    const double wild = WildFrom(errors);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (!(errors[i] > wild) || !Acts(Mechanism::kWildReadings)) continue;
      observations[i]->weight = kRejectedWeight;
    }
  }
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

double RejectedFrom(std::size_t tests) {
  const double level = kRejectionLevel / static_cast<double>(std::max<std::size_t>(tests, 1));
  return std::sqrt(ChiSquareQuantile(1.0 - level, 1.0));
}

double ResidualDof(const PoseGraph& graph, const ReducedSystem& system) {
  double dof = static_cast<double>(graph.priors.size()) - system.rank();
  for (const PoseNode& node : graph.nodes) {
    dof += node.row_count() - node.tangent_size();
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      // A rejected triad loses its three rows. If the pose's unknown is a rotation, the other triad
      // determines only two of its three coordinates.
      dof -= node.kind == PoseKind::kRotation && !node.has_attitude_prior ? 2 : 3;
      if (node.kind == PoseKind::kDirection) dof += 2;
    }
  }
  for (const PoseNode& node : graph.nodes) {
    if (node.role == PoseRole::kTurnAxis) dof -= 1.0;  // the row along the axis has no weight
  }
  for (const IncrementEdge& edge : graph.increments) {
    if (edge.rejected) continue;
    // The rows across the axis of a known turn that is not a whole turn have no weight either.
    const bool is_broken = edge.stated_covariance.trace() > kSaysNothingRad * kSaysNothingRad;
    dof += is_broken ? 1.0 : 3.0;
  }
  return dof;
}

OffOptimum FurthestOff(const NoiseState& noise,
                       const PoseGraph& graph,
                       const ReducedSystem& system) {
  return FurthestOff(noise.estimate, ExcessFloor(noise, graph), graph, system);
}

int SettleNoise(const RobustOptions& robust,
                NoiseState* noise,
                PoseGraph* graph,
                SolveLog* log,
                Findings* findings) {
  ApplyExcess(noise->excess, graph);
  ReducedSystem system(*graph);
  UnknownNoise unknown{noise->estimated, {}};
  const double dof = ResidualDof(*graph, system);
  const bool weighs = robust.enabled && dof >= kMinRobustDof;
  if (robust.enabled && !weighs) {
    findings->push_back(
        Finding(FindingCode::kOutliersNotSought,
                Format("few residual degrees of freedom (%.0f): outliers cannot be identified, and "
                       "were not sought",
                       dof))
            .With("degrees_of_freedom", dof));
  }
  if (dof < 1.0) {
    if (!noise->estimated.empty()) {
      findings->emplace_back(FindingCode::kExcessUnknown,
                             "no residual degrees of freedom: pose-to-pose noise could not be "
                             "estimated; σ include only the noise within rests");
    }
    for (const NoiseComponent component : noise->estimated) {
      const bool from_residuals = noise->IsFromResiduals(component);
      noise->unknown = noise->unknown || from_residuals;
      if (!from_residuals) noise->excess[component] = 0.0;
    }
    noise->estimated.clear();
  }
  if (!weighs && noise->estimated.empty()) {
    ApplyExcess(noise->excess, graph);
    log->Solve(kFinalTolerance, graph);
    return 0;
  }
  if (weighs && Acts(Mechanism::kMedianNoise)) GuessExcessFromMedians(noise, graph, &system);
  int rounds = 0;
  for (int pass = 0; pass < kMostNoisePasses; ++pass) {
    const bool came_to_an_end = TakeRounds(
        weighs ? &robust : nullptr, noise, &unknown, graph, &system, log, findings, &rounds);
    if (came_to_an_end) log->Solve(kFinalTolerance, graph);
    system.Linearise(*graph);
    StateCurvatures(*graph, system, &noise->estimate);
    // In the rounds, turns are integrated only once. The last solution integrates them again, and
    // if the parameters moved far, it has different residuals.
    if (!came_to_an_end || FurthestOff(*noise, *graph, system).IsSettled()) break;
    if (pass + 1 < kMostNoisePasses && !Acts(Mechanism::kNoisePasses)) break;
  }
  return rounds;
}

}  // namespace truetriad
