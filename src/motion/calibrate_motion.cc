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
#include "motion/motion_graph.h"
#include "motion/motion_start.h"
#include "motion/track.h"
#include "problem/graph.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/field_side.h"
#include "solve/solve_graph.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/result.h"
#include "verdict/verdict.h"

namespace truetriad {
namespace {

// The least spacing of the chain with which starts and noise are settled. A finer chain would be no
// better: each reading is rotated to its nearest node, and the accelerations of a hand stay
// correlated for much longer than this.
constexpr double kSettlingSpacingS = 0.1;
// Chosen: after so many rounds, Settle ends with the noise and the clocks of the last round.
constexpr int kMaxRounds = 20;
// Most solver iterations of Settle; a chain that determines its parameters takes a hundred.
constexpr int kMaxIterations = 500;
// If a density changes by less than 2 %, σ changes by less than 1 %, and it has settled.
constexpr double kSettledNoise = 0.02;
// If the correction of a clock changes by less than this share of its σ, it has settled.
constexpr double kSettledClock = 0.1;
// If the χ² of the next step is smaller than this (about one σ for each of some twenty unknowns), a
// single Gauss-Newton step replaces the solver.
constexpr double kNearChi2 = 20.0;
// The largest clock error, as a share of the duration. If it is larger, the readings of the sensors
// cannot be related to each other.
constexpr double kMostClockError = 0.01;
// If a clock differs by more than this many σ, this is reported; chance exceeds 4 σ once in 16,000.
constexpr double kSaidClockError = 4.0;
// Tolerance while noise and clocks change. At χ² = 1e5 it leaves at most 0.3 σ to the optimum.
constexpr double kRoughTolerance = 1e-6;
// The tolerance of the final solution. At χ² = 1e5 it is within 0.001 σ of the optimum.
constexpr double kMotionTolerance = 1e-11;

// The state of the calibration from one start.
struct MotionRun {
  PoseGraph graph;
  std::vector<Moment> moments;  // the moment of each of the graph's nodes
  MotionNoiseState noise;
  SolveLog log;
  PerTriad<double> clock_sigma_s{};  // σ of MotionTrack::ahead_s
  int rounds = 0;
};

GyroModel GyroscopeOf(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  GyroModel model{graph.ModelAt(Triad::kGyroscope, PoseNode())};
  if (layout.g_sensitivity >= 0) {
    model.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(&graph.shared[layout.g_sensitivity]);
  }
  return model;
}

// Rebuilds the graph's nodes from the present moments, weighted by the present noise.
void Rebuild(const MotionTrack& track,
             const std::vector<Eigen::Quaterniond>& attitudes,
             MotionRun* run) {
  BuildMoments(track, run->moments, attitudes, &run->graph);
  WeighMoments(run->noise.noise, track, run->moments, &run->graph);
}

// Gathers the readings again, rotated with the present gyroscope model; keeps robust weights.
void GatherAgain(const CalibrateOptions& options,
                 double spacing_s,
                 MotionTrack* track,
                 MotionRun* run) {
  const GyroModel gyroscope = GyroscopeOf(run->graph);
  if (options.triads[Triad::kGyroscope].g_sensitivity == Wanted::kYes) {
    track->SetForces(run->graph.ModelAt(Triad::kAccelerometer, PoseNode()));
  }
  std::vector<Moment> moments = track->Gather(spacing_s, &gyroscope);
  std::size_t c = 0;
  for (Moment& moment : moments) {
    while (c + 1 < run->moments.size() && run->moments[c + 1].reading <= moment.reading) ++c;
    moment.accelerometer.weight = run->moments[c].accelerometer.weight;
    moment.magnetometer.weight = run->moments[c].magnetometer.weight;
    moment.weight = run->moments[c].weight;
  }
  const std::vector<Eigen::Quaterniond> attitudes =
      FinerAttitudes(*track, gyroscope, run->moments, AttitudesOf(run->graph), moments);
  run->moments = std::move(moments);
  Rebuild(*track, attitudes, run);
}

// A first fit from one start.
MotionRun FirstFit(const PoseSet& poses,
                   const CalibrateOptions& options,
                   const StartValues& start,
                   double spacing_s,
                   MotionTrack* track) {
  MotionRun run;
  LayOutParameters(options, start, &run.graph);
  AddPriors(options, &run.graph);
  const GyroModel gyroscope = GyroscopeOf(run.graph);
  if (options.triads[Triad::kGyroscope].g_sensitivity == Wanted::kYes) {
    track->SetForces(*start.models[Triad::kAccelerometer]);
  }
  run.moments = track->Gather(spacing_s, &gyroscope);
  run.noise = ChooseMotionNoise(poses, options, start, *track);
  Rebuild(*track, StartAttitudes(start, *track, run.moments), &run);
  run.log.Solve(kRoughTolerance, &run.graph);
  return run;
}

// Corrects the vector sensors' clocks. Returns the largest change of a clock, in its σ.
double UpdateClocks(const ReducedSystem& system, MotionTrack* track, MotionRun* run) {
  const PerTriad<ClockError> errors = ClockErrorsOf(run->moments, run->graph, system);
  double change = 0.0;
  for (const Triad triad : kTriads) {
    const ClockError& error = errors[triad];
    if (!(error.sigma_s > 0.0) || !Acts(Mechanism::kMotionClocks)) continue;
    const double most = kMostClockError * track->duration_s();
    track->set_ahead_s(triad, std::clamp(track->ahead_s(triad) + error.ahead_s, -most, most));
    run->clock_sigma_s[triad] = error.sigma_s;
    change = std::max(change, std::abs(error.ahead_s) / error.sigma_s);
  }
  return change;
}

// Updates weights, noise, clocks and solution in turn until they settle.
void Settle(const CalibrateOptions& options, double spacing_s, MotionTrack* track, MotionRun* run) {
  const auto is_over = [run] {
    return run->rounds > kMaxRounds || run->log.iterations > kMaxIterations;
  };
  for (run->rounds = 1; !is_over(); ++run->rounds) {
    GatherAgain(options, spacing_s, track, run);
    ReducedSystem system(run->graph);
    const double change =
        UpdateMotionNoise(options.robust, *track, &run->moments, &run->graph, &system, &run->noise);
    const double clock_change = UpdateClocks(system, track, run);
    if (system.step().dot(system.information() * system.step()) < kNearChi2) {
      system.TakeStep(system.step(), &run->graph);
      ++run->log.iterations;
    } else {
      run->log.Solve(kRoughTolerance, &run->graph);
    }
    if (!run->log.converged) break;
    if (change < kSettledNoise && clock_change < kSettledClock) break;
  }
}

// The time that the readings at one node cover; for the gyroscope, the time between two nodes.
double AveragedTime(const MotionTrack& track, const MotionRun& run, Triad triad) {
  if (triad == Triad::kGyroscope) {
    return track.duration_s() /
           static_cast<double>(std::max<std::size_t>(run.moments.size(), 2) - 1);
  }
  double readings = 0.0, seen = 0.0;
  for (const Moment& node : run.moments) {
    readings += node.seen(triad).count;
    seen += node.seen(triad).count > 0 ? 1.0 : 0.0;
  }
  return track.spacing_s(triad) * std::max(readings / std::max(seen, 1.0), 1.0);
}

// Findings about how the solution was reached.
Findings RemarksOf(const CalibrateOptions& options,
                   const MotionTrack& track,
                   const MotionRun& run) {
  Findings remarks = {Finding(FindingCode::kFollowedMotion,
                              "the attitude was tracked through the motion: a chain of " +
                                  std::to_string(run.moments.size()) +
                                  Format(" attitudes over %.0f s", track.duration_s()))
                          .With("attitudes", static_cast<double>(run.moments.size()))
                          .With("duration", track.duration_s(), "s")};
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled || !(run.noise.correlation[triad] > 1.0)) continue;
    remarks.push_back(
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
    remarks.push_back(ClockCorrected(triad, ahead_s, run.clock_sigma_s[triad], Triad::kGyroscope));
  }
  if (track.untold() > 0) {
    remarks.push_back(Finding(FindingCode::kGyroscopeGaps,
                              Format("the gyroscope has no data for %.2f s in ", track.untold_s()) +
                                  Counted(track.untold(), "place") + ": the chain is broken there")
                          .About(Triad::kGyroscope)
                          .With("duration", track.untold_s(), "s")
                          .With("places", track.untold()));
  }
  return remarks;
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

MotionNoiseFound NoiseFound(const MotionTrack& track, const MotionRun& run) {
  MotionNoiseFound found;
  for (const Triad triad : kTriads) {
    if (!run.graph.layout.Has(triad)) continue;
    found.stated[triad] = NoiseOf(track, run, run.graph.sensitivity(triad), triad);
    found.reading_sigma_raw[triad] =
        (run.noise.noise.density[triad] / track.spacing_s(triad)).cwiseSqrt();
  }
  return found;
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
  TRUETRIAD_ASSIGN_OR_RETURN(MotionTrack track, MotionTrack::Of(poses, wanted));
  const auto starts = FindMotionStarts(poses, options, track);
  if (!starts) {
    if (starts.error().kind() != ErrorKind::kNotEnough) return starts.error();
    return refuse(RefusalOf(starts.error()));
  }
  if (const auto mapped = WithMagnetometerMap(options, starts->front())) {
    return CalibrateMotion(poses, *mapped, summary);
  }
  const double wanted_s = options.motion->spacing_s;
  const double settling_s = std::max(wanted_s, kSettlingSpacingS);
  std::optional<MotionRun> best;
  for (const StartValues& start : *starts) {
    MotionRun run = FirstFit(poses, options, start, settling_s, &track);
    if (!std::isfinite(run.log.final_cost)) continue;
    if (!best || run.log.final_cost < best->log.final_cost) best = std::move(run);
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
  Settle(options, settling_s, &track, &run);
  if (run.noise.correlation[Triad::kAccelerometer] > 1.0 && Acts(Mechanism::kCarriedForce)) {
    run.noise.is_carried = true;
    Settle(options, settling_s, &track, &run);
  }
  SettleField(options, std::numeric_limits<double>::infinity(), &run.graph);
  GatherAgain(options, wanted_s, &track, &run);
  run.log.Solve(kMotionTolerance, &run.graph);
  summary->rounds = run.rounds;
  summary->iterations = run.log.iterations;
  summary->initial_cost = run.log.initial_cost;
  summary->final_cost = run.log.final_cost;
  NoiseState noise;
  noise.source = run.noise.source;
  const MotionNoiseFound found = NoiseFound(track, run);
  return StateVerdict(
      {poses, options, run.graph, noise, run.log.converged, RemarksOf(options, track, run), &found},
      &calibration);
}

}  // namespace truetriad
