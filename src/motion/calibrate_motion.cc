// SPDX-License-Identifier: Apache-2.0
#include "motion/calibrate_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "model/mechanisms.h"
#include "motion/chain.h"
#include "motion/motion_noise.h"
#include "motion/motion_start.h"
#include "motion/track.h"
#include "problem/graph.h"
#include "problem/graph_builder.h"
#include "problem/hemisphere.h"
#include "problem/start_values.h"
#include "solve/field_side.h"
#include "solve/solve_graph.h"
#include "verdict/checks/check.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/checks/units.h"
#include "verdict/observability.h"
#include "verdict/presentation.h"
#include "verdict/quality.h"
#include "verdict/recording_faults.h"
#include "verdict/result.h"
#include "verdict/time_blocks.h"

namespace truetriad {
namespace {

// Noise and starts are settled on a chain no finer than this: the readings between two of its nodes
// lose nothing, and a hand's accelerations stay correlated much longer.
constexpr double kSettlingSpacingS = 0.1;
constexpr int kMaxRounds = 20;
// A density that changes less than this moves σ by half of it.
constexpr double kSettledNoise = 0.02;
// Likewise a clock, in its σ.
constexpr double kSettledClock = 0.1;
// Of the duration: a clock further off than this belongs to another recording.
constexpr double kMostClockError = 0.01;
// A clock is said to be ahead from this many σ on.
constexpr double kSaidClockError = 4.0;
constexpr double kRoughTolerance = 1e-6;
constexpr double kMotionTolerance = 1e-11;
// A fit whose residual is this share of the field does not explain the data.
constexpr double kExplainedShare = 0.5;
// Nodes that stand for the whole chain where single ones are looked at.
constexpr std::size_t kShownNodes = 200;
// A chain that the gyroscope does not tell for longer is no chain.
constexpr double kMuchUntoldShare = 0.1;

// Everything about one start, as far as it has come.
struct MotionRun {
  StartValues start;
  PoseGraph graph;  // without nodes: the shared parameters
  std::vector<MotionNode> nodes;
  std::vector<Eigen::Quaterniond> attitudes;
  MotionNoiseState noise;
  SolveOutcome outcome;
  PerTriad<double> clock_sigma_s{};  // of MotionTrack::ahead_s
  int iterations = 0;
  int rounds = 0;
};

TriadModel<double> ModelOf(const PoseGraph& graph, Triad triad) {
  return ModelOf(graph.layout, triad, graph.shared.data());
}

GyroModel GyroscopeOf(const PoseGraph& graph) {
  return GyroscopeOf(graph.layout, graph.shared.data());
}

// The run's chain; it refers to the run's parameters.
MotionChain ChainOf(const MotionTrack& track, const MotionRun& run) {
  MotionChain chain(run.graph.layout, run.graph.priors, track, run.nodes, run.attitudes);
  chain.SetNoise(run.noise.noise, run.graph.shared.data());
  return chain;
}

void Solve(double tolerance, MotionChain* chain, MotionRun* run) {
  run->outcome = chain->Solve(run->graph.solver, tolerance, &run->graph.shared);
  run->iterations += run->outcome.iterations;
  run->attitudes = chain->attitudes();
}

// Gathers the readings again, with the gyroscope as it is now known, robust weights staying.
void GatherAgain(const CalibrateOptions& options,
                 double spacing_s,
                 MotionTrack* track,
                 MotionRun* run) {
  const GyroModel gyroscope = GyroscopeOf(run->graph);
  if (options.triads[Triad::kGyroscope].g_sensitivity == Wanted::kYes) {
    track->SetForces(ModelOf(run->graph, Triad::kAccelerometer));
  }
  std::vector<MotionNode> nodes = track->Gather(spacing_s, &gyroscope);
  std::size_t c = 0;
  for (MotionNode& node : nodes) {
    while (c + 1 < run->nodes.size() && run->nodes[c + 1].reading <= node.reading) ++c;
    node.accelerometer.weight = run->nodes[c].accelerometer.weight;
    node.magnetometer.weight = run->nodes[c].magnetometer.weight;
    node.weight = run->nodes[c].weight;
  }
  run->attitudes = FinerAttitudes(*track, gyroscope, run->nodes, run->attitudes, nodes);
  run->nodes = std::move(nodes);
}

// A first fit from one start.
MotionRun FirstFit(const PoseSet& poses,
                   const CalibrateOptions& options,
                   const StartValues& start,
                   double spacing_s,
                   MotionTrack* track) {
  MotionRun run;
  run.start = start;
  LayOutParameters(options, start, &run.graph);
  AddPriors(options, &run.graph);
  const GyroModel gyroscope = GyroscopeOf(run.graph);
  if (options.triads[Triad::kGyroscope].g_sensitivity == Wanted::kYes) {
    track->SetForces(*start.models[Triad::kAccelerometer]);
  }
  run.nodes = track->Gather(spacing_s, &gyroscope);
  run.attitudes = StartAttitudes(start, *track, run.nodes);
  run.noise = ChooseMotionNoise(poses, options, start, *track);
  MotionChain chain = ChainOf(*track, run);
  Solve(kRoughTolerance, &chain, &run);
  return run;
}

// Allows for clocks that are ahead. Returns the largest change in σ.
double UpdateClocks(const MotionChain& chain, MotionTrack* track, MotionRun* run) {
  double change = 0.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!run->graph.layout.Has(triad)) continue;
    const MotionChain::ClockError error = chain.ClockErrorOf(triad, run->graph.shared.data());
    if (!(error.sigma_s > 0.0) || !Acts(Mechanism::kMotionClocks)) continue;
    const double most = kMostClockError * track->duration_s();
    track->set_ahead_s(triad, std::clamp(track->ahead_s(triad) + error.ahead_s, -most, most));
    run->clock_sigma_s[triad] = error.sigma_s;
    change = std::max(change, std::abs(error.ahead_s) / error.sigma_s);
  }
  return change;
}

// Weights, noise, clocks and solution in turn until they stay.
void Settle(const CalibrateOptions& options, double spacing_s, MotionTrack* track, MotionRun* run) {
  for (run->rounds = 1; run->rounds <= kMaxRounds; ++run->rounds) {
    GatherAgain(options, spacing_s, track, run);
    MotionChain chain = ChainOf(*track, *run);
    const double change = UpdateMotionNoise(options.robust, run->graph.shared, &chain, &run->noise);
    const double clock_change = UpdateClocks(chain, track, run);
    Solve(kRoughTolerance, &chain, run);
    run->nodes = chain.nodes();
    if (!run->outcome.converged) break;
    if (change < kSettledNoise && clock_change < kSettledClock) break;
  }
}

// The same solution, with the field on the side where it is; of a dip that is stated with a σ,
// which follows when it is solved again, the likelier.
void SettleField(const CalibrateOptions& options, MotionRun* run) {
  constexpr double kDipSigmaRad = 0.0;  // of thousands of readings
  const SharedLayout& layout = run->graph.layout;
  bool turns = SettleHemisphereOfField(options, kDipSigmaRad, &run->graph);
  if (layout.IsFree(layout.reference + kDip) && MayReverseAgainstDip(options, layout)) {
    const double other = SideOfStatedDip(options.reference.dip_rad, run->graph.reference()[kDip]);
    const bool is_told = std::abs(other) > FarInChi2(std::numeric_limits<double>::infinity());
    if (is_told ? other < 0.0 : IsOfOtherHand(options, run->graph)) {
      ReverseField(options, &run->graph);
      turns = !turns;
    }
  }
  if (!turns) return;
  for (Eigen::Quaterniond& attitude : run->attitudes) attitude = TurnedHalfway(attitude);
}

// Some nodes of the chain as poses, for what looks at single ones.
std::vector<PoseNode> ShownNodes(const MotionTrack& track, const MotionRun& run) {
  std::vector<PoseNode> shown;
  const std::size_t every = run.nodes.size() / kShownNodes + 1;
  for (std::size_t k = 0; k < run.nodes.size(); k += every) {
    PoseNode node;
    node.number = static_cast<int>(k + 1);
    node.is_field_inclined = run.graph.layout.Has(Triad::kAccelerometer);
    const Eigen::Quaterniond& q = run.attitudes[k];
    node.state = {q.x(), q.y(), q.z(), q.w()};
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      const GatheredReadings& seen = run.nodes[k].seen(triad);
      if (seen.count == 0 || !run.graph.layout.Has(triad)) continue;
      Observation observation;
      observation.triad = triad;
      observation.mean_raw = seen.mean_raw;
      observation.variance =
          (run.noise.noise.density[triad] / (track.spacing_s(triad) * seen.count)).asDiagonal();
      observation.weight = seen.weight;
      node.observations.push_back(observation);
    }
    if (!node.observations.empty()) shown.push_back(node);
  }
  return shown;
}

// Time that the readings at one node stand for; of the gyroscope the time between two nodes.
double AveragedTime(const MotionTrack& track, const MotionRun& run, Triad triad) {
  if (triad == Triad::kGyroscope) {
    return track.duration_s() / static_cast<double>(std::max<std::size_t>(run.nodes.size(), 2) - 1);
  }
  double readings = 0.0, seen = 0.0;
  for (const MotionNode& node : run.nodes) {
    readings += node.seen(triad).count;
    seen += node.seen(triad).count > 0 ? 1.0 : 0.0;
  }
  return track.spacing_s(triad) * std::max(readings / std::max(seen, 1.0), 1.0);
}

// RMS of |C(y - b)| - reference and coverage, over all nodes.
void StateFit(const PoseSet& poses, const MotionRun& run, Quality* quality) {
  const ReferenceVector reference = run.graph.reference();
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!run.graph.layout.Has(triad)) continue;
    const TriadModel<double> model = ModelOf(run.graph, triad);
    const double strength = WorldVector(triad, reference).norm();
    const StreamSummary& stream = *poses.Find(triad);
    double after = 0.0, before = 0.0;
    std::vector<Eigen::Vector3d> directions;
    for (std::size_t k = 0; k < run.nodes.size(); ++k) {
      const GatheredReadings& seen = run.nodes[k].seen(triad);
      if (seen.count == 0) continue;
      const double error = NormError(model, seen.mean_raw, strength);
      const double error_before = seen.mean_raw.norm() * stream.unit.truth_per_raw - strength;
      after += error * error;
      before += error_before * error_before;
      directions.emplace_back(run.attitudes[k].conjugate() *
                              WorldVector(triad, reference).normalized());
    }
    if (directions.empty()) continue;
    const auto count = static_cast<double>(directions.size());
    quality->residual_rms[triad] = std::sqrt(after / count);
    if (!stream.unit.is_counts) quality->residual_rms_before[triad] = std::sqrt(before / count);
    quality->coverage.push_back(DirectionCoverage(triad, directions));
  }
}

double DegreesOfFreedom(const MotionRun& run) {
  double rows = static_cast<double>(run.graph.priors.size()) - run.graph.layout.free_size();
  PerTriad<bool> is_seen{};  // in this piece of the chain
  for (const MotionNode& node : run.nodes) {
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      if (node.seen(triad).count == 0 || !run.graph.layout.Has(triad)) continue;
      rows += 3.0;
      is_seen[triad] = true;
    }
    if (node.is_linked) continue;
    // A turn has as many rows as an attitude unknowns; a heading that nothing tells is held.
    rows -= 3.0;
    if (!is_seen[Triad::kMagnetometer] || !is_seen[Triad::kAccelerometer]) rows += 1.0;
    is_seen = {};
  }
  return rows;
}

void SayRemarks(const CalibrateOptions& options,
                const MotionTrack& track,
                const MotionRun& run,
                Findings* findings) {
  findings->push_back(Finding(FindingCode::kFollowedMotion,
                              "the unit was followed through its motion: a chain of " +
                                  std::to_string(run.nodes.size()) +
                                  Format(" attitudes over %.0f s", track.duration_s()))
                          .With("attitudes", static_cast<double>(run.nodes.size()))
                          .With("duration", track.duration_s(), "s"));
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled || !(run.noise.correlation[triad] > 1.0)) continue;
    findings->push_back(
        Finding(FindingCode::kCorrelatedResiduals,
                std::string(TriadName(triad)) +
                    Format(": residuals are correlated from one attitude to the next (%.1f times "
                           "the variance of white noise); weights and σ allow for it",
                           run.noise.correlation[triad]))
            .About(triad)
            .With("variance_ratio", run.noise.correlation[triad]));
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const double ahead_s = track.ahead_s(triad);
    if (!options.triads[triad].enabled ||
        !(std::abs(ahead_s) > kSaidClockError * run.clock_sigma_s[triad])) {
      continue;
    }
    findings->push_back(
        ClockCorrected(triad, ahead_s, run.clock_sigma_s[triad], Triad::kGyroscope));
  }
  const Findings mounting = CheckMounting(options, run.graph);
  findings->insert(findings->end(), mounting.begin(), mounting.end());
  if (track.untold() > 0) {
    findings->push_back(
        Finding(FindingCode::kGyroscopeGaps,
                Format("the gyroscope has no usable data for %.2f s in ", track.untold_s()) +
                    Counted(track.untold(), "place") +
                    " (gaps, saturation or repeated readings): the chain is broken there")
            .About(Triad::kGyroscope)
            .With("duration", track.untold_s(), "s")
            .With("places", track.untold()));
  }
}

// Why a solution cannot be used; empty when it can.
Findings WhyUnusable(const PoseSet& poses,
                     const CalibrateOptions& options,
                     const ReferenceValues& reference,
                     const MotionTrack& track,
                     const MotionRun& run,
                     const PresentedSolution& solution,
                     const Quality& quality,
                     bool determined) {
  const Findings non_finite =
      CheckFinite(TriadOptions(), run.graph.shared.allFinite(), solution.covariance);
  if (Find(non_finite, FindingCode::kNonFinite) != nullptr) return non_finite;
  if (!determined) {
    return {{FindingCode::kNotDetermined,
             "the motion does not determine every parameter that was asked for",
             "see the weak directions"}};
  }
  if (!non_finite.empty()) return non_finite;
  if (track.broken_s() > kMuchUntoldShare * track.duration_s()) {
    return {Finding(FindingCode::kGyroscopeGaps,
                    Format("the gyroscope has no usable data for %.1f s of ", track.untold_s()) +
                        Format("%.1f s (gaps, saturation or repeated readings): what moved "
                               "meanwhile is not known",
                               track.duration_s()))
                .As(Severity::kRefusal)
                .About(Triad::kGyroscope)
                .With("duration", track.untold_s(), "s")};
  }
  PerTriad<Eigen::Matrix3d> sensitivity;
  for (const Triad triad : kTriads) {
    if (options.triads[triad].enabled) sensitivity[triad] = run.graph.sensitivity(triad);
  }
  Findings gains = CheckGains(poses, options, sensitivity, reference);
  if (OutcomeOf(gains) != Outcome::kConverged) return gains;
  Findings unexplained = CheckExplained(quality,
                                        run.graph.reference(),
                                        kExplainedShare,
                                        "this is no unit turned in one constant field");
  if (!unexplained.empty()) return unexplained;
  if (!run.outcome.converged) {
    return {{FindingCode::kDidNotConverge,
             "the optimiser did not converge: the readings do not fit the model from any start"}};
  }
  Findings mounting = CheckMounting(options, run.graph);
  return OutcomeOf(mounting) == Outcome::kConverged ? Findings() : mounting;
}

TriadNoise NoiseOf(const MotionTrack& track,
                   const MotionRun& run,
                   const Eigen::Matrix3d& sensitivity,
                   Triad triad) {
  TriadNoise noise;
  noise.source = run.noise.source[triad];
  const double averaged_s = AveragedTime(track, run, triad);
  noise.sigma = (run.noise.noise.density[triad] / averaged_s).cwiseSqrt();
  if (run.noise.source[triad] == NoiseSource::kResidual) return noise;
  const Eigen::Vector3d stated = (run.noise.stated.density[triad] / averaged_s).cwiseSqrt();
  const Eigen::Vector3d gain = sensitivity.rowwise().norm();
  noise.excess_sigma = std::sqrt((noise.sigma.cwiseAbs2() - stated.cwiseAbs2())
                                     .cwiseQuotient(gain.cwiseAbs2())
                                     .cwiseMax(0.0)
                                     .mean());
  noise.sigma = stated;
  return noise;
}

// Each stretch as a chain of its own.
std::vector<TimeBlock> TimeBlocksOf(const MotionChain& chain, const Eigen::VectorXd& shared) {
  std::vector<TimeBlock> blocks;
  const std::size_t count = chain.nodes().size();
  for (std::size_t b = 0; b < kTimeBlocks; ++b) {
    const std::size_t begin = b * count / kTimeBlocks, end = (b + 1) * count / kTimeBlocks;
    if (end - begin < 2) return {};
    const ChainElimination solved = chain.LinearisedAt(shared, begin, end);
    blocks.push_back({solved.information(), solved.gradient()});
  }
  return blocks;
}

Status StateMotionVerdict(const PoseSet& poses,
                          const CalibrateOptions& options,
                          const MotionTrack& track,
                          const MotionChain& chain,
                          MotionRun* run,
                          Calibration* calibration) {
  Quality& quality = calibration->quality;
  PoseGraph& graph = run->graph;
  graph.nodes = ShownNodes(track, *run);
  quality.poses = static_cast<int>(run->nodes.size());
  quality.dof = DegreesOfFreedom(*run);
  quality.effective_dof = std::numeric_limits<double>::infinity();
  const ChainElimination solved = chain.LinearisedAt(graph.shared);
  quality.reduced_chi2 = 2.0 * solved.cost() / quality.dof;
  quality.reduced_chi2_before = std::numeric_limits<double>::quiet_NaN();
  StateReference(options, graph, &calibration->reference);
  StateFit(poses, *run, &quality);

  const SharedInformation information(
      graph.layout, graph.shared, solved.information(), solved.gradient());
  Observability observability = AnalyseObservability(
      graph, information, options.observable_sigma, "keep it in motion longer");
  quality.weak_directions = std::move(observability.weak_directions);
  const CalibrateOptions bends = WithLeftOutBends(options, graph.layout);
  PoseGraph larger = WithTermsOf(bends, graph);
  FreeWholeMatrices(bends, &larger);
  const std::vector<ProbedTerm> probes = AppendProbes(&larger.layout);
  larger.shared.conservativeResizeLike(Eigen::VectorXd::Zero(larger.layout.size));
  MotionChain bent(larger.layout, larger.priors, track, run->nodes, run->attitudes);
  bent.SetNoise(run->noise.noise, larger.shared.data());
  bent.SetProbes(probes, larger.shared.data());
  const ChainElimination solved_bent = bent.LinearisedAt(larger.shared);
  LeftOutTerms left_out = FindLeftOutTerms(graph,
                                           information.covariance(),
                                           options,
                                           larger.layout,
                                           probes,
                                           solved_bent.information(),
                                           solved_bent.gradient());
  left_out.has_temperature = poses.temperature_range_degc.has_value();
  PerTriad<Eigen::Vector3d> sigma_raw{};
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!graph.layout.Has(triad)) continue;
    sigma_raw[triad] = (run->noise.noise.density[triad] / track.spacing_s(triad)).cwiseSqrt();
  }
  std::vector<TurnMiss> misses;
  if (graph.layout.Has(Triad::kGyroscope)) misses = chain.TurnMisses(solved);
  AddFaultsOfRecording(poses, sigma_raw, misses, graph, information.covariance(), &left_out);
  quality.left_out_tests = left_out.tests;
  const BlockScatter blocks =
      ScatterOf(TimeBlocksOf(chain, graph.shared), information.matrix(), graph);
  const Eigen::MatrixXd covariance =
      information.covariance() + left_out.covariance + blocks.covariance;
  PresentedSolution solution = SolvedFrame(graph, covariance);
  StateInGauge(options, &solution);

  const bool determined = observability.determined && information.rank() >= information.size();
  calibration->findings = WhyUnusable(
      poses, options, calibration->reference, track, *run, solution, quality, determined);
  DropSwitchedOff(&calibration->findings);
  if (calibration->findings.empty()) {
    PerTriad<TriadNoise> noise;
    for (const Triad triad : kTriads) {
      if (!options.triads[triad].enabled) continue;
      noise[triad] = NoiseOf(track, *run, solution.models[triad]->sensitivity, triad);
    }
    StateSolution(options, poses, solution, noise, calibration);
    SayRemarks(options, track, *run, &calibration->findings);
    for (const Findings& found :
         {CheckMagnetometerScale(calibration->reference),
          CheckHand(options, graph, solution.covariance, quality.effective_dof),
          FindingsOf(left_out),
          FindingsOf(blocks),
          CheckStillDetermined(graph, covariance, options.observable_sigma)}) {
      calibration->findings.insert(calibration->findings.end(), found.begin(), found.end());
    }
    DropSwitchedOff(&calibration->findings);
  }
  return Conclude(options, poses, calibration);
}

}  // namespace

Status CalibrateMotion(const PoseSet& poses,
                       const CalibrateOptions& options,
                       CalibrationSummary* summary) {
  Calibration& calibration = summary->calibration;
  const auto refuse = [&](Finding refusal) -> Status {
    calibration.findings.push_back(std::move(refusal));
    return Conclude(options, poses, &calibration);
  };
  PerTriad<bool> wanted{};
  for (const Triad triad : kTriads) wanted[triad] = options.triads[triad].enabled;
  auto track = MotionTrack::Of(poses, wanted);
  if (!track) return track.error();
  const auto starts = FindMotionStarts(poses, options, *track);
  if (!starts) {
    if (starts.error().kind() != ErrorKind::kNotEnough) return starts.error();
    return refuse(RefusalOf(starts.error()));
  }
  if (const auto map = MagnetometerMapOf(options, starts->front())) {
    return CalibrateMotion(poses, WithMagnetometerMap(*map, options), summary);
  }
  const double wanted_s = options.motion->spacing_s;
  const double settling_s = std::max(wanted_s, kSettlingSpacingS);
  std::optional<MotionRun> best;
  for (const StartValues& start : *starts) {
    MotionRun run = FirstFit(poses, options, start, settling_s, &*track);
    if (!std::isfinite(run.outcome.final_cost)) continue;
    if (!best || run.outcome.final_cost < best->outcome.final_cost) best = std::move(run);
  }
  if (!best) {
    return refuse({FindingCode::kSolverFailed, "the optimiser failed from every start"});
  }
  MotionRun& run = *best;
  if (run.graph.layout.free_size() == 0) {
    return Error(ErrorCode::kNothingToEstimate,
                 "every parameter is fixed by `fixed:`; nothing is left to estimate")
        .About("sensors");
  }
  Settle(options, settling_s, &*track, &run);
  if (run.noise.correlation[Triad::kAccelerometer] > 1.0 && Acts(Mechanism::kCarriedForce)) {
    run.noise.is_carried = true;
    Settle(options, settling_s, &*track, &run);
  }
  SettleField(options, &run);
  GatherAgain(options, wanted_s, &*track, &run);
  MotionChain chain = ChainOf(*track, run);
  Solve(kMotionTolerance, &chain, &run);
  summary->rounds = run.rounds;
  summary->iterations = run.iterations;
  summary->initial_cost = run.outcome.initial_cost;
  summary->final_cost = run.outcome.final_cost;
  return StateMotionVerdict(poses, options, *track, chain, &run, &calibration);
}

}  // namespace truetriad
