// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/calibrate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "calibrate/calibrate_settled.h"
#include "calibrate/why_not_as_settled.h"
#include "choice/model_choice.h"
#include "data/pose_statistics.h"
#include "model/mechanisms.h"
#include "motion/calibrate_motion.h"
#include "noise/deletion.h"
#include "noise/joint_test.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/field_side.h"
#include "solve/reduced_system.h"
#include "solve/solve_graph.h"
#include "start/start.h"
#include "start/why_no_start.h"
#include "sweep/calibrate_sweep.h"
#include "truetriad/verdict/summary.h"
#include "verdict/checks/held_gyroscope.h"
#include "verdict/checks/soak.h"
#include "verdict/checks/units.h"
#include "verdict/face_tilts.h"
#include "verdict/observability.h"
#include "verdict/verdict.h"

namespace truetriad {
namespace {

// A measure of how badly the poses fit: the sum of log(1 + χ² / dof) over all deletion tests and
// priors. This is the cost of a Cauchy distribution, in which a few outliers count little, however
// large they are.
double RobustMisfit(const PoseGraph& graph) {
  const ReducedSystem system(graph);
  double misfit = 0.0;
  for (const DeletionTest& test : DeletionTests(graph, system)) {
    if (test.rank > 0) misfit += std::log1p(test.chi2 / test.rank);
  }
  for (const ScalarPrior& prior : graph.priors) {
    misfit += std::log1p(std::pow((graph.shared[prior.index] - prior.mean) / prior.sigma, 2));
  }
  return misfit;
}

// A refusal from poses.findings for an enabled sensor. If there is none, a refusal for too few
// poses. If there are enough poses, unset.
std::optional<Finding> WhyTooFewRests(const PoseSet& poses, const CalibrateOptions& options) {
  for (const Finding& finding : poses.findings) {
    if (finding.IsRefusal() && finding.sensor && options.triads[*finding.sensor].enabled) {
      return finding;
    }
  }
  if (const Status counts = CheckPoseCounts(poses, options); !counts) {
    return RefusalOf(counts.error());
  }
  return std::nullopt;
}

// The poses at the temperature that most of them share.
PoseSet AtOneTemperature(const PoseSet& poses) {
  const std::vector<std::vector<std::size_t>> settings = PosesByTemperature(poses);
  if (settings.empty()) return poses;
  const auto most =
      std::max_element(settings.begin(), settings.end(), [](const auto& a, const auto& b) {
        return a.size() < b.size();
      });
  return PosesAmong(poses, *most);
}

// Shifts the gyroscope's readings of each session so that their median at rest is that of the first
// session, since start values have one bias only.
PoseSet WithOneGyroscopeBias(PoseSet poses) {
  std::vector<PoseSet> rests(poses.sessions.size());
  for (const StaticPose& pose : poses.poses) {
    rests[static_cast<std::size_t>(pose.session)].poses.push_back(pose);
  }
  std::vector<Eigen::Vector3d> off;
  for (const PoseSet& session : rests) off.push_back(MedianReading(session, Triad::kGyroscope));
  for (std::size_t k = off.size(); k-- > 0;) off[k] -= off.front();
  const auto off_of = [&](const StaticPose& pose) -> const Eigen::Vector3d& {
    return off[static_cast<std::size_t>(pose.session)];
  };
  for (RecordedMove& move : poses.moves) {
    for (Eigen::Vector3d& raw : move.gyroscope_raw) raw -= off_of(poses.poses[move.from]);
  }
  for (StaticPose& pose : poses.poses) {
    if (auto& seen = pose.triads[Triad::kGyroscope]) seen->mean_raw -= off_of(pose);
  }
  return poses;
}

// Finds start values. If there are temperature terms, also finds some from the poses of one
// temperature alone: if a unit drifts much, its readings over all temperatures do not lie on one
// ellipsoid.
Result<std::vector<StartValues>> FindStarts(const PoseSet& poses, const CalibrateOptions& options) {
  const bool has_gyroscope = options.triads[Triad::kGyroscope].enabled;
  if (has_gyroscope && options.HasSessionBias(Triad::kGyroscope) && !poses.sessions.empty()) {
    PoseSet same_bias = WithOneGyroscopeBias(poses);
    same_bias.sessions.clear();
    return FindStarts(same_bias, options);
  }
  auto starts = FindStartValues(poses, options);
  const bool is_wrong = !starts && starts.error().kind() != ErrorKind::kNotEnough;
  if (!options.HasThermal() || is_wrong) return starts;
  const PoseSet same = AtOneTemperature(poses);
  if (!CheckPoseCounts(same, options)) return starts;
  auto more = FindStartValues(same, options);
  if (!more || !Acts(Mechanism::kOneTemperatureStarts)) return starts;
  if (starts) more->insert(more->end(), starts->begin(), starts->end());
  return more;
}

// The graph of the nodes, laid out at the start values.
PoseGraph GraphAt(const CalibrateOptions& options,
                  const StartValues& start,
                  std::vector<PoseNode> nodes) {
  PoseGraph graph;
  graph.nodes = std::move(nodes);
  LayOutParameters(options, start, &graph);
  return graph;
}

// Refines every start (several, if a magnetometer's rotation has several solutions) and returns the
// fit with the least RobustMisfit, in which a few disturbed poses, such as three beside a magnet,
// do not decide. Unset if no fit converges to a finite cost.
std::optional<PoseGraph> SolveFromBestStart(const PoseSet& poses,
                                            const std::vector<StartValues>& starts,
                                            std::vector<PoseNode> nodes,
                                            const CalibrateOptions& options,
                                            NoiseState* noise,
                                            SolveLog* log) {
  std::optional<PoseGraph> best;
  double best_misfit = std::numeric_limits<double>::infinity();
  for (const StartValues& start : starts) {
    PoseGraph graph = GraphAt(options, start, &start == &starts.back() ? std::move(nodes) : nodes);
    if (options.triads[Triad::kGyroscope].enabled) BuildIncrements(poses, start, &graph);
    AddPriors(options, &graph);
    StartNoise(noise, &graph);
    // At different temperatures, or in different sessions, the lengths of readings may truly
    // differ; then no reading is downweighted for its length.
    if (!options.HasThermal() && poses.sessions.empty()) {
      WeighReadingsAtStart(options.robust, &graph);
    }
    log->Solve(kRoundTolerance, &graph);
    if (!std::isfinite(log->final_cost)) continue;
    const double misfit = starts.size() > 1 ? RobustMisfit(graph) : 0.0;
    if (misfit < best_misfit) {
      best_misfit = misfit;
      best = std::move(graph);
    }
  }
  return best;
}

// Whether nonlinearity terms are estimated along with a bias or sensitivity. Far from the optimum,
// with wrong gains, these terms diverge; close to it they are small.
bool HasBentAxes(const CalibrateOptions& options) {
  const auto has = [&options](auto condition) {
    return std::any_of(options.triads.begin(), options.triads.end(), condition);
  };
  return has([](const TriadOptions& triad) { return triad.HasAxisTerm(Wanted::kYes); }) &&
         has([](const TriadOptions& triad) {  // has free parameters other than these terms
           return triad.enabled && !(triad.fixed_bias && triad.fixed_sensitivity);
         });
}

CalibrateOptions WithStraightAxes(CalibrateOptions options) {
  for (TriadOptions& triad : options.triads) {
    std::replace(triad.axis_terms.begin(), triad.axis_terms.end(), Wanted::kYes, Wanted::kNo);
  }
  return options;
}

// Whether the poses determine every free parameter, given the noise that weights the graph.
bool IsDetermined(const PoseGraph& graph, const CalibrateOptions& options) {
  const ReducedSystem system(graph);
  return system.rank() == system.size() &&
         AnalyseObservability(graph, system.shared(), options.observable_sigma).determined;
}

// Adds the nonlinearity terms to a solution without them: first to the rough solution and, if this
// does not converge, to the solution whose noise is settled. Terms that the poses do not determine
// have no optimum; they stay zero, and the verdict names them. Returns the number of rounds.
int SettleBentAxes(const CalibrateOptions& options,
                   const CalibrateOptions& straight,
                   NoiseState* noise,
                   PoseGraph* graph,
                   SolveLog* log,
                   Findings* findings) {
  const PoseGraph rough = *graph;
  const NoiseState rough_noise = *noise;
  int rounds = 0;
  *graph = WithTermsOf(options, rough);
  if (IsDetermined(*graph, options) && Acts(Mechanism::kRoughBends)) {
    Findings found;
    log->Solve(kRoundTolerance, graph);
    if (log->converged) rounds = SettleNoise(options.robust, noise, graph, log, &found);
    if (log->converged && graph->shared.allFinite()) {
      findings->insert(findings->end(), found.begin(), found.end());
      return rounds;
    }
  }
  *graph = rough;
  *noise = rough_noise;
  Findings found_again;
  rounds += SettleNoise(straight.robust, noise, graph, log, &found_again);
  const NoiseState settled = *noise;
  *noise = rough_noise;
  noise->excess = settled.excess;
  noise->estimate = settled.estimate;
  *graph = WithTermsOf(options, *graph);
  ApplyExcess(noise->excess, graph);
  if (!IsDetermined(*graph, options)) return rounds;
  log->Solve(kRoundTolerance, graph);
  if (!log->converged) return rounds;
  return rounds + SettleNoise(options.robust, noise, graph, log, findings);
}

Status CheckRecorded(const PoseSet& poses, const CalibrateOptions& options) {
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled || poses.Find(triad) != nullptr) continue;
    return Error(
        ErrorCode::kMissingSensor,
        {poses.source},
        "the " + std::string(TriadName(triad)) + " is enabled but missing from the recording");
  }
  return {};
}

CalibrationSummary Refuse(Finding refusal, CalibrationSummary summary) {
  summary.calibration.findings.push_back(std::move(refusal));
  summary.calibration.outcome = OutcomeOf(summary.calibration.findings);
  return summary;
}

// Settles whether the field points above or below the horizontal, then noise and parameters
// together. Returns the number of rounds.
int Settle(const CalibrateOptions& options,
           NoiseState* noise,
           PoseGraph* graph,
           SolveLog* log,
           Findings* findings) {
  SettleField(options, NoiseDof(noise->estimate, *graph), graph);
  int rounds = HasBentAxes(options)
                   ? SettleBentAxes(options, WithStraightAxes(options), noise, graph, log, findings)
                   : SettleNoise(options.robust, noise, graph, log, findings);
  if (SettleField(options, NoiseDof(noise->estimate, *graph), graph)) {
    // The noise was estimated with the former sign of the field. It is therefore estimated again;
    // the findings of the first estimate are kept.
    Findings known;
    rounds += SettleNoise(options.robust, noise, graph, log, &known);
  }
  return rounds;
}

// Calibrates from rests, rows or known attitudes.
Result<CalibrationSummary> CalibratePoses(const PoseSet& poses,
                                          const CalibrateOptions& options,
                                          CalibrationSummary summary,
                                          SettledModel* settled) {
  Calibration& calibration = summary.calibration;
  NoiseState noise = ChooseNoise(poses, options, &calibration.findings);
  calibration.quality.poses = static_cast<int>(poses.poses.size());
  if (auto refusal = WhyTooFewRests(poses, options)) {
    return Refuse(*std::move(refusal), std::move(summary));
  }
  const auto starts = FindStarts(poses, options);
  if (!starts) {
    if (starts.error().kind() != ErrorKind::kNotEnough) return starts.error();
    calibration.quality.weak_directions = WeakDirectionsOfReadings(poses, options);
    return Refuse(RefusalOf(starts.error()), std::move(summary));
  }
  if (const auto mapped = WithMagnetometerMap(options, starts->front())) {
    return CalibrateSettled(poses, *mapped, settled);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<PoseNode> nodes, BuildNodes(poses, options, noise.source));
  if (options.initialise.only) {
    const PoseGraph graph = GraphAt(options, starts->front(), std::move(nodes));
    StateStart(poses, options, noise, starts->front(), graph, &calibration);
    return summary;
  }
  if (auto wrong = WhyHeldGyroscopeIsWrong(poses, starts->front(), nodes, options);
      wrong && Acts(Mechanism::kHeldGyroscope)) {
    return Refuse(*std::move(wrong), std::move(summary));
  }
  SolveLog log;
  std::optional<PoseGraph> graph =
      SolveFromBestStart(poses,
                         *starts,
                         std::move(nodes),
                         HasBentAxes(options) ? WithStraightAxes(options) : options,
                         &noise,
                         &log);
  if (!graph) {
    return Refuse({FindingCode::kSolverFailed, "the optimiser failed from every start"},
                  std::move(summary));
  }
  if (graph->layout.free_size() == 0) {
    return Error(ErrorCode::kNothingToEstimate,
                 "every parameter is fixed by `fixed:`; nothing is left to estimate")
        .About("sensors");
  }
  summary.rounds = Settle(options, &noise, &*graph, &log, &calibration.findings);
  if (const auto tilts = TiltsBeyondStated(*graph, options);
      tilts && Acts(Mechanism::kFacesTilted)) {
    auto with_larger = CalibrateSettled(poses, WithTilts(*tilts, options), settled);
    if (with_larger) with_larger->calibration.findings.push_back(FindingOf(*tilts, options));
    return with_larger;
  }
  if (auto why = WhyNotAsSettled(options, noise, *graph)) {
    return Refuse(*std::move(why), std::move(summary));
  }
  summary.iterations = log.iterations;
  summary.initial_cost = log.initial_cost;
  summary.final_cost = log.final_cost;
  TRUETRIAD_RETURN_IF_ERROR(
      StateVerdict({poses, options, *graph, noise, log.converged}, &calibration));
  if (settled != nullptr) *settled = {*std::move(graph), std::move(noise)};
  return summary;
}

}  // namespace

Calibration StatedCalibration(const CalibrateOptions& options) {
  Calibration calibration;
  calibration.mode = options.mode();
  calibration.gauge = options.gauge;
  calibration.gauge_sensor = LeadingTriad(options);
  calibration.reference.gravity_mps2 = *options.reference.gravity_mps2.value;
  calibration.reference.temperature_degc = options.reference.temperature_degc;
  return calibration;
}

Result<CalibrationSummary> CalibrateSettled(const PoseSet& poses,
                                            const CalibrateOptions& options,
                                            SettledModel* settled) {
  CalibrationSummary summary;
  summary.options = options;
  summary.calibration = StatedCalibration(options);
  summary.calibration.serial = poses.serial;
  TRUETRIAD_RETURN_IF_ERROR(CheckRecorded(poses, options));
  if (auto refusal = WhyNotAsStated(poses, options)) {
    return Refuse(*std::move(refusal), std::move(summary));
  }
  if (!options.motion && !options.sweep) {
    return CalibratePoses(poses, options, std::move(summary), settled);
  }
  TRUETRIAD_RETURN_IF_ERROR(options.motion ? CalibrateMotion(poses, options, &summary)
                                           : CalibrateSweep(poses, options, &summary));
  return summary;
}

Result<CalibrationSummary> Calibrate(const PoseSet& poses, const CalibrateOptions& options) {
  TRUETRIAD_RETURN_IF_ERROR(options.Validate());
  const int temperatures = static_cast<int>(PosesByTemperature(poses).size());
  Result<CalibrationSummary> summary =
      options.HasChoice()
          ? CalibrateWithChoice(
                options,
                temperatures,
                [&poses](const CalibrateOptions& settled_options, SettledModel* settled) {
                  return CalibrateSettled(poses, settled_options, settled);
                })
          : CalibrateSettled(poses, options, nullptr);
  if (summary && !options.sweep) {
    const auto recorded = RecordedDegc(poses);
    summary->calibration.reference.recorded_degc = recorded;
    if (options.HasThermal() && options.HasChoice() && temperatures == 1 && recorded) {
      summary->calibration.findings.push_back(
          Finding(FindingCode::kOneTemperature,
                  Format("`auto`: all poses were taken at about %.1f degC, so no temperature terms "
                         "were chosen: bias and sensitivity hold at that temperature",
                         (*recorded)[1]))
              .With("temperature", (*recorded)[1], "degC"));
    }
  }
  return summary;
}

}  // namespace truetriad
