// SPDX-License-Identifier: Apache-2.0
#include "verdict/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "model/mechanisms.h"
#include "noise/deletion.h"
#include "noise/joint_test.h"
#include "problem/graph_builder.h"
#include "problem/known_motion_rows.h"
#include "problem/start_values.h"
#include "verdict/observability.h"
#include "verdict/quality.h"
#include "verdict/result.h"
#include "verdict/sessions.h"

namespace truetriad {
namespace {

// The first check that refuses names the cause, so that the order of the checks matters: a change
// in the middle of the run may look like any other fault, and if a direction is undetermined, the
// optimiser does not converge along it.
constexpr std::array<Check, 12> kUsability = {&CheckFinite,
                                              &CheckRowsAreRests,
                                              &CheckNoiseKnown,
                                              &CheckExplained,
                                              &CheckFaultsAllow,
                                              &CheckTemperatureModelled,
                                              &CheckOutliers,
                                              &CheckDetermined,
                                              &CheckConverged,
                                              &CheckGains,
                                              &CheckNotCorrected,
                                              &CheckMounting};
constexpr std::array<Check, 15> kRemarks = {&CheckDegreesOfFreedom,
                                            &CheckRejectedPoses,
                                            &CheckHeldGyroscope,
                                            &CheckClockOffsets,
                                            &CheckNoiseFree,
                                            &CheckStatedNoise,
                                            &CheckStatedValues,
                                            &CheckCoverage,
                                            &CheckTemperatures,
                                            &CheckMagnetometerScale,
                                            &CheckHand,
                                            &CheckDrift,
                                            &CheckFaults,
                                            &CheckCurves,
                                            &CheckSessions};

bool Wants(const CalibrateOptions& options, Triad triad) { return options.triads[triad].enabled; }

// Temperature range of a triad's accepted poses.
Eigen::Vector2d TemperatureRange(const PoseGraph& graph, Triad triad) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector2d range(kInfinity, -kInfinity);
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& observation : node.observations) {
      if (observation.triad != triad || observation.rejected) continue;
      range[0] = std::min(range[0], node.temperature_degc);
      range[1] = std::max(range[1], node.temperature_degc);
    }
  }
  return range;
}

// The noise by which a triad was weighted.
TriadNoise NoiseOf(const SettledRun& run, Triad triad) {
  if (run.of_motion != nullptr) return run.of_motion->stated[triad];
  const NoiseState& noise = run.noise;
  TriadNoise stated;
  // RMS over poses of each axis' σ.
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  int count = 0;
  const bool has_rests =
      std::any_of(run.graph.nodes.begin(), run.graph.nodes.end(), [](const PoseNode& node) {
        return node.role == PoseRole::kRest;
      });
  for (const PoseNode& node : run.graph.nodes) {
    if (node.role != (has_rests ? PoseRole::kRest : PoseRole::kRate)) continue;
    for (const Observation& observation : node.observations) {
      if (observation.triad != triad || observation.rejected) continue;
      rest += observation.rest_covariance.diagonal();
      total += observation.variance.diagonal();
      ++count;
    }
  }
  stated.source = noise.source[triad];
  const bool residual = noise.source[triad] == NoiseSource::kResidual;
  stated.sigma = ((residual ? total : rest) / std::max(count, 1)).cwiseSqrt();
  stated.excess_sigma = residual ? 0.0 : std::sqrt(noise.excess[triad]);
  stated.excess_dof = ExcessDegreesOfFreedom(noise.estimate, run.graph, PoseNoise(triad));
  if (triad == Triad::kGyroscope) {
    stated.turn_excess_sigma_rad = std::sqrt(noise.excess[NoiseComponent::kTurn]);
  }
  return stated;
}

int CountPoses(const PoseGraph& graph) {
  return static_cast<int>(
      std::count_if(graph.nodes.begin(), graph.nodes.end(), [](const PoseNode& node) {
        return node.role == PoseRole::kRest || node.role == PoseRole::kMoment;
      }));
}

// σ of one reading of each sensor.
PerTriad<Eigen::Vector3d> ReadingSigma(const SettledRun& run) {
  if (run.of_motion != nullptr) return run.of_motion->reading_sigma_raw;
  PerTriad<Eigen::Vector3d> sigma_raw{};
  for (const StreamSummary& stream : run.poses.streams) {
    sigma_raw[stream.triad] = stream.noise_sigma_raw;
  }
  return sigma_raw;
}

void StateRejected(const PoseGraph& graph, Quality* quality) {
  for (const IncrementEdge& edge : graph.increments) {
    if (!edge.rejected || edge.stated_turn >= 0) continue;
    quality->rests.rejected_poses.push_back({graph.nodes[edge.from + 1].number,
                                             Triad::kGyroscope,
                                             "the turn from pose " +
                                                 std::to_string(graph.nodes[edge.from].number) +
                                                 " to this one disagrees with all other turns"});
  }
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& observation : node.observations) {
      if (!observation.rejected) continue;
      const auto at =
          std::find_if(quality->rests.pose_residuals.begin(),
                       quality->rests.pose_residuals.end(),
                       [&](const auto& residual) {
                         return residual.pose == node.number && residual.triad == observation.triad;
                       });
      quality->rests.rejected_poses.push_back(
          {node.number,
           observation.triad,
           Format("disagrees with all other poses by %.1f times its noise", at->normalized)});
    }
  }
}

// χ² of the residuals over their degrees of freedom.
double ReducedChi2(const ReducedSystem& system, double dof) {
  return (system.residual() + system.J() * system.step()).dot(system.projected()) / dof;
}

// States χ² with the whole noise, and if the noise inside rests is known, χ² with that alone.
void StateChi2(const SettledRun& run, const ReducedSystem& system, double dof, Quality* quality) {
  quality->reduced_chi2 = std::numeric_limits<double>::quiet_NaN();
  quality->reduced_chi2_before = std::numeric_limits<double>::quiet_NaN();
  if (dof < 1.0) return;
  quality->reduced_chi2 = ReducedChi2(system, dof);
  if (run.of_motion != nullptr) return;
  for (const Triad triad : kTriads) {
    if (Wants(run.options, triad) && run.noise.source[triad] == NoiseSource::kResidual) return;
  }
  PoseGraph rests = run.graph;
  ApplyExcess(ExcessVariance{}, &rests);
  quality->reduced_chi2_before = ReducedChi2(ReducedSystem(rests), dof);
}

// Whether to test for faults: the solution and its noise must be known. A motion has thousands of
// moments: if it does not determine the parameters, it is refused in any case, and not tested.
bool CanBeTested(const SettledRun& run, const ReducedSystem& system) {
  if (run.of_motion != nullptr &&
      !AnalyseObservability(run.graph, system.shared(), run.options.observable_sigma).determined) {
    return false;
  }
  return run.converged && !run.noise.unknown && system.size() > 0 &&
         system.rank() == system.size() && std::isfinite(system.cost()) &&
         system.covariance().allFinite() && Acts(Mechanism::kFaults);
}

// Runs the checks until one refuses.
bool IsUsable(const SettledRun& run, const SolvedRun& solved, Findings* findings) {
  for (const Check check : kUsability) {
    Findings found = check(run, solved);
    DropSwitchedOff(&found);
    findings->insert(findings->end(), found.begin(), found.end());
    if (OutcomeOf(found) != Outcome::kConverged) return false;
  }
  return true;
}

// States the sensors, and remarks for the reader.
void StateUsable(const SettledRun& run,
                 const SolvedRun& solved,
                 const Eigen::MatrixXd& covariance,
                 const TurnErrors& turns,
                 Calibration* calibration) {
  const CalibrateOptions& options = run.options;
  PerTriad<TriadNoise> noise;
  for (const Triad triad : kTriads) {
    if (Wants(options, triad)) noise[triad] = NoiseOf(run, triad);
  }
  StateSolution(options, run.poses, solved.solution, noise, calibration);
  for (const Triad triad : kTriads) {
    std::optional<TriadCalibration>& sensor = calibration->sensors[triad];
    if (sensor && sensor->thermal) sensor->thermal->range_degc = TemperatureRange(run.graph, triad);
  }
  RestQuality& rests = calibration->quality.rests;
  if (run.of_motion == nullptr) {
    rests.held_out = CrossValidate(run.graph, solved.system, turns, options.cross_validation_folds);
  }
  StateSessions(run.poses, run.graph, covariance, &rests);
  Findings& findings = calibration->findings;
  const auto add = [&findings](const Findings& found) {
    findings.insert(findings.end(), found.begin(), found.end());
  };
  add(run.remarks);
  for (const Check check : kRemarks) add(check(run, solved));
  add(CheckStillDetermined(run.graph, covariance, options.observable_sigma));
}

// Removes from `quality` what does not explain a refusal, and all values if some are not finite.
void KeepWhatExplains(const SettledRun& run,
                      const PresentedSolution& solution,
                      const Findings& findings,
                      Quality* quality) {
  // Weak directions advise more poses, but too many poses are rejected already.
  if (Find(findings, FindingCode::kTooManyOutliers) != nullptr) quality->weak_directions.clear();
  const Eigen::MatrixXd& matrix = solution.covariance.matrix;
  const bool is_finite = std::isfinite(run.graph.shared.squaredNorm()) && matrix.allFinite();
  if (is_finite && matrix.diagonal().minCoeff() >= 0.0) return;
  std::vector<WeakDirection> weak = std::move(quality->weak_directions);
  *quality = Quality{};
  quality->poses = CountPoses(run.graph);
  if (run.graph.shared.allFinite()) quality->weak_directions = std::move(weak);
}

}  // namespace

Status StateVerdict(const SettledRun& settled, Calibration* calibration) {
  const CalibrateOptions& options = settled.options;
  PoseGraph graph = settled.graph;
  NoiseState state = settled.noise;
  ReducedSystem system(graph);
  const OffOptimum off = FurthestOff(state, graph, system);
  Unmodelled unmodelled;
  if (CanBeTested(settled, system)) {
    TakeFaultsIn(options, settled.poses, &graph, &state, &system, &unmodelled);
  } else {
    unmodelled.faults.beyond = Eigen::MatrixXd::Zero(system.size(), system.size());
  }
  const SettledRun run{
      settled.poses, options, graph, state, settled.converged, settled.remarks, settled.of_motion};
  Quality& quality = calibration->quality;
  quality.poses = CountPoses(graph);
  quality.dof = ResidualDof(graph, system);
  const JointTest joint = KenwardRogerTest(run.noise.estimate, system);
  quality.rests.temperature_settings = FindTemperatureSettings(graph);
  FindBeyondFaults(
      run.poses, ReadingSigma(run), graph, system, quality.rests.temperature_settings, &unmodelled);
  quality.rests.clock_offsets = unmodelled.clocks;
  quality.left_out_tests = TestsOf(unmodelled.faults);
  const std::vector<LeftOutTest>& more = unmodelled.of_recording.tests;
  quality.left_out_tests.insert(quality.left_out_tests.begin(), more.begin(), more.end());
  quality.effective_dof = std::min(joint.dof, unmodelled.drift.dof);
  // Dividing the covariance by the joint test's scale makes F(dim, ν) hold for the covariance as
  // reported.
  const Eigen::MatrixXd covariance =
      AdjustedCovariance(run.noise.estimate, system) / joint.scale + unmodelled.Covariance();
  StateReference(options, graph, &calibration->reference);

  const bool is_of_motion = run.of_motion != nullptr;
  Observability observability =
      is_of_motion
          ? AnalyseObservability(
                graph, system.shared(), options.observable_sigma, "keep it in motion longer")
          : AnalyseObservability(graph, system.shared(), options.observable_sigma);
  quality.weak_directions = std::move(observability.weak_directions);

  PresentedSolution solution = SolvedFrame(graph, covariance);
  StateInGauge(options, &solution);
  // A motion has no rests between which turns could be checked.
  const TurnErrors turns = is_of_motion ? TurnErrors() : FindTurnErrors(graph, system, run.poses);
  FillPoseQuality(graph, solution, DeletionTests(graph, system), turns, run.poses, &quality);
  StateRejected(graph, &quality);
  if (Wants(options, Triad::kGyroscope)) {
    quality.rests.turns =
        CheckTurns(run.poses, graph, covariance, run.noise.excess[NoiseComponent::kTurn]);
  }
  StateChi2(run, system, quality.dof, &quality);

  const SolvedRun solved{
      system, solution, unmodelled, settled.noise, off, observability.determined, *calibration};
  if (!IsUsable(run, solved, &calibration->findings)) {
    KeepWhatExplains(run, solution, calibration->findings, &quality);
    return Conclude(options, run.poses, calibration);
  }
  StateUsable(run, solved, covariance, turns, calibration);
  DropSwitchedOff(&calibration->findings);
  return Conclude(options, run.poses, calibration);
}

void StateStart(const PoseSet& poses,
                const CalibrateOptions& options,
                const NoiseState& noise,
                const StartValues& start,
                const PoseGraph& graph,
                Calibration* calibration) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix3d Q = LeadingGaugeRotation(
      options, options.gauge, start.models[LeadingTriad(options)]->sensitivity);
  for (const Triad triad : kTriads) {
    if (!start.models[triad]) continue;
    TriadCalibration sensor = InUnits(triad, poses);
    sensor.model = {start.models[triad]->sensitivity * Q, start.models[triad]->bias};
    sensor.mounting = MountingOf(options, triad, sensor.model.sensitivity);
    sensor.bias_sigma.setConstant(unknown);
    sensor.sensitivity_sigma.setConstant(unknown);
    sensor.noise.sigma.setConstant(unknown);
    sensor.noise.source = noise.source[triad];
    calibration->sensors[triad] = sensor;
    if (triad == Triad::kGyroscope) continue;  // no field to compare with
    const double strength = WorldVector(triad, start.reference).norm();
    double sum = 0.0;
    int count = 0;
    for (const PoseNode& node : graph.nodes) {
      for (const Observation& observation : node.observations) {
        if (observation.triad != triad) continue;
        const double error = NormError(sensor.model, observation.mean_raw, strength);
        sum += error * error;
        ++count;
      }
    }
    if (count > 0) calibration->quality.residual_rms[triad] = std::sqrt(sum / count);
  }
  calibration->reference.gravity_mps2 = start.reference[kGravity];
  if (Wants(options, Triad::kMagnetometer)) {
    calibration->reference.field_ut = start.reference[kField];
    calibration->reference.field_nominal = start.field_nominal;
    if (Wants(options, Triad::kAccelerometer))
      calibration->reference.dip_rad = start.reference[kDip];
  }
  calibration->quality.poses = CountPoses(graph);
  calibration->quality.reduced_chi2 = unknown;
  calibration->quality.reduced_chi2_before = unknown;
  calibration->findings.emplace_back(FindingCode::kStartValuesOnly,
                                     "start values only, as asked: no refinement, no uncertainty");
  calibration->outcome = OutcomeOf(calibration->findings);
}

}  // namespace truetriad
