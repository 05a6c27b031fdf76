// SPDX-License-Identifier: Apache-2.0
#include "planning/plan_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include <glog/logging.h>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "model/attitude_sets.h"
#include "problem/graph_builder.h"
#include "problem/moves.h"
#include "problem/parameter_name.h"
#include "problem/start_values.h"
#include "solve/reduced_system.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

constexpr std::array kPlannedTriads = {
    Triad::kAccelerometer, Triad::kGyroscope, Triad::kMagnetometer};
// Readings of a gyroscope to come, Hz: what counts is the density of their noise.
constexpr double kPlannedRateHz = 100.0;
// Where nothing is known a parameter may be off by this many times the signal.
constexpr double kAnything = 10.0;
// Eigenvalues of the information below this share of the largest are rounding.
constexpr double kRounding = 1e-14;
// Inverse condition number above which an inverse keeps six digits and more.
constexpr double kWellConditioned = 1e-10;
// So many that a rest is as long as the time between its first and last sample.
constexpr std::int64_t kRestSamples = 1'000'000'000;
// Of the field, at middle latitudes.
constexpr double kUsualFieldUt = 50.0;
constexpr double kUsualDipRad = std::numbers::pi / 3.0;

std::string FaceUp(const Eigen::Quaterniond& world_from_body) {
  const Eigen::Vector3d up = world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return std::string(up[axis] < 0.0 ? "-" : "+") + kAxisLetters[static_cast<std::size_t>(axis)];
}

// Poses that between them have every temperature to come, and every face of a six-face block.
std::vector<ProgramPose> SpanningPoses(const PlanOptions& options) {
  std::vector<ProgramPose> poses;
  if (options.program) {
    poses = options.program->poses;
  } else {
    for (const double temperature : options.grid.temperatures_degc) {
      poses.push_back({Eigen::Quaterniond::Identity(), temperature, ""});
    }
  }
  if (options.calibrate.attitudes.kind == AttitudeKind::kSixFace) {
    const auto temperature = poses.empty() ? std::nullopt : poses.front().temperature_degc;
    for (const Eigen::Quaterniond& face : SixFaceAttitudes()) {
      poses.push_back({face, temperature, ""});
    }
  }
  return poses;
}

}  // namespace

Result<PlanProblem> PlanProblem::Create(const PoseSet& measured, const PlanOptions& options) {
  PlanProblem problem;
  problem.calibrate_ = options.calibrate;
  problem.rest_s_ = options.rest_s;
  problem.attitude_sigma_rad_ = options.attitude_sigma_rad;
  problem.measured_ = measured;
  problem.has_heading_ = options.calibrate.attitudes.kind == AttitudeKind::kGiven ||
                         options.calibrate.triads[Triad::kMagnetometer].enabled;
  for (const Triad triad : kPlannedTriads) {
    if (!options.calibrate.triads[triad].enabled || measured.Find(triad) != nullptr) continue;
    if (!measured.poses.empty()) {
      return BadInputError(
          measured.source + ": the " + std::string(TriadName(triad)) +
          " is enabled but missing from the recording; record it, or remove it from `sensors:`");
    }
    StreamSummary stream;
    stream.triad = triad;
    stream.unit = options.units[triad];
    problem.measured_.streams.push_back(stream);
  }
  TRUETRIAD_RETURN_IF_ERROR(problem.ChooseNominal(measured, options));

  auto nodes = BuildNodes(problem.measured_, problem.calibrate_, problem.source_);
  if (!nodes) return nodes.error();
  PoseGraph& graph = problem.graph_;
  graph.nodes = *std::move(nodes);
  // The layout is that of all poses to come: every face of a block has its tilt, and the scaled
  // variables of temperature terms span all temperatures.
  if (const std::vector<ProgramPose> spanning = SpanningPoses(options); !spanning.empty()) {
    graph.nodes = problem.Nodes(problem.ExactReadings(spanning));
  }
  LayOutParameters(problem.calibrate_, problem.nominal_, &graph);
  if (graph.layout.free_size() == 0) {
    return UsageError("every parameter is fixed by `fixed:`; nothing is left to plan for");
  }
  AddPriors(problem.calibrate_, &graph);
  graph.nodes = problem.Nodes(problem.measured_);
  if (problem.has_gyroscope()) graph = problem.GraphWith({});

  const ReducedSystem system(graph);
  problem.scale_ = system.scale();
  problem.known_ = system.scale().asDiagonal() * system.information() * system.scale().asDiagonal();
  problem.FindQuantities();
  return problem;
}

// Where the graph is linearised, and what its rows are weighted with: from a calibration of what is
// measured, if that is enough for one, else from what is stated.
Status PlanProblem::ChooseNominal(const PoseSet& measured, const PlanOptions& options) {
  const ReferenceOptions& reference = calibrate_.reference;
  const bool free_attitudes = calibrate_.attitudes.kind == AttitudeKind::kNone;
  std::optional<Calibration> calibrated;
  if (!measured.poses.empty()) {
    CalibrateOptions solved = calibrate_;
    solved.gauge = free_attitudes ? Gauge::kAccelX : Gauge::kFixture;
    solved.limits = {};
    solved.cross_validation_folds = 0;
    solved.initialise.only = false;
    auto summary = Calibrate(measured, solved);
    TRUETRIAD_RETURN_IF_ERROR(summary);
    if (summary->calibration.IsUsable()) calibrated = std::move(summary->calibration);
    messages_.push_back(
        calibrated
            ? "linearised at the calibration of the recording"
            : "the recording is not enough for a calibration; linearised at the nominal values");
  }
  const double usual_dip_rad = reference.northern_hemisphere ? kUsualDipRad : -kUsualDipRad;
  nominal_.reference << *reference.gravity_mps2.value,
      reference.field_ut.value.value_or(options.nominal_field_ut.value_or(kUsualFieldUt)),
      reference.dip_rad.value.value_or(options.nominal_dip_rad.value_or(usual_dip_rad)), 0.0;
  for (const Triad triad : kPlannedTriads) {
    TriadOptions& sensor = calibrate_.triads[triad];
    if (!sensor.enabled) continue;
    const Unit& unit = measured_.Find(triad)->unit;
    if (calibrated) {
      nominal_.models[triad] = calibrated->sensors[triad]->model;
    } else if (options.nominal[triad]) {
      nominal_.models[triad] = options.nominal[triad];
    } else if (unit.is_counts && !sensor.fixed_sensitivity) {
      return BadInputError(std::string(TriadName(triad)) +
                           ": readings are in counts of unknown size; state roughly how many "
                           "counts one true unit is, as in `plan: { nominal: { " +
                           std::string(TriadName(triad)) + ": { sensitivity: 400 } } }`");
    } else {
      const double sign = triad == LeadingTriad(calibrate_) ? LeadingAxisSign(calibrate_) : 1.0;
      nominal_.models[triad] = {sign / unit.truth_per_raw * Eigen::Matrix3d::Identity(),
                                Eigen::Vector3d::Zero()};
    }
    if (sensor.fixed_sensitivity) nominal_.models[triad]->sensitivity = *sensor.fixed_sensitivity;
    if (sensor.model == MatrixModel::kBias && !sensor.fixed_sensitivity) {
      sensor.fixed_sensitivity = nominal_.models[triad]->sensitivity;
    }
  }
  const Triad leading = LeadingTriad(calibrate_);
  if (!calibrated && free_attitudes && !calibrate_.triads[leading].fixed_sensitivity) {
    const Eigen::Matrix3d Q = GaugeRotation(
        Gauge::kAccelX, nominal_.models[leading]->sensitivity, LeadingAxisSign(calibrate_));
    for (auto& model : nominal_.models) {
      if (model) model->sensitivity = model->sensitivity * Q;
    }
  }
  if (calibrated) {
    if (calibrated->reference.field_ut)
      nominal_.reference[kField] = *calibrated->reference.field_ut;
    if (calibrated->reference.dip_rad) nominal_.reference[kDip] = *calibrated->reference.dip_rad;
  } else if (calibrate_.triads[Triad::kMagnetometer].enabled) {
    if (!reference.field_ut.known() && !options.nominal_field_ut) {
      messages_.push_back("field strength unknown: planned for " +
                          Format("%.4g uT (plan.nominal.strength_ut)", nominal_.reference[kField]));
    }
    if (!reference.dip_rad.known() && !options.nominal_dip_rad) {
      messages_.push_back(
          "dip unknown: planned for " +
          Format("%.3g deg (plan.nominal.dip_deg)", nominal_.reference[kDip] * kDegPerRad));
    }
  }
  if (calibrate_.attitudes.kind == AttitudeKind::kGiven) {
    Eigen::Vector3d field = Eigen::Vector3d::Zero();
    for (const StaticPose& pose : measured_.poses) {
      if (!pose.triads[Triad::kMagnetometer] || !nominal_.models[Triad::kMagnetometer]) continue;
      field += pose.attitude->world_from_body * nominal_.models[Triad::kMagnetometer]->TruthFromRaw(
                                                    pose.triads[Triad::kMagnetometer]->mean_raw);
    }
    if (!field.isZero(0.0)) nominal_.reference[kHeading] = std::atan2(field.y(), field.x());
  }
  return ChooseNoise(measured, options, calibrated);
}

Status PlanProblem::ChooseNoise(const PoseSet& measured,
                                const PlanOptions& options,
                                const std::optional<Calibration>& calibrated) {
  for (const Triad triad : kPlannedTriads) {
    const TriadOptions& sensor = calibrate_.triads[triad];
    if (!sensor.enabled) continue;
    rest_covariance_[triad].setZero();
    source_[triad] = NoiseSource::kStatic;
    if (sensor.noise_sigma_raw) {
      source_[triad] = sensor.noise_source;
    } else if (sensor.allan) {
      source_[triad] = NoiseSource::kAllan;
      if (!(options.rest_s > 0.0)) {
        return BadInputError(std::string(TriadName(triad)) +
                             ": its noise is a density, so the length of a rest is needed; state "
                             "it, as in `plan: { rest_s: 5 }`");
      }
    } else if (calibrated) {
      source_[triad] = calibrated->sensors[triad]->noise.source;
      rest_covariance_[triad] = calibrated->sensors[triad]->noise.sigma.cwiseAbs2().asDiagonal();
    } else {
      int count = 0;
      for (const StaticPose& pose : measured.poses) {
        if (!pose.triads[triad] || !pose.triads[triad]->has_covariance) continue;
        rest_covariance_[triad] += pose.triads[triad]->mean_covariance_raw;
        ++count;
      }
      if (count == 0) {
        return BadInputError(std::string(TriadName(triad)) +
                             ": its noise is unknown; state `noise: { sigma: [x, y, z] }` (of a "
                             "pose's mean, raw unit) or `noise: { allan: FILE }` with `plan: { "
                             "rest_s: … }`, or give a recording with rests");
      }
      rest_covariance_[triad] /= count;
    }
    if (sensor.excess == ExcessNoise::kGiven) {
      excess_[triad] = sensor.excess_sigma * sensor.excess_sigma;
    } else if (sensor.excess == ExcessNoise::kEstimate) {
      const double sigma = calibrated ? calibrated->sensors[triad]->noise.excess_sigma : 0.0;
      excess_[triad] = sigma * sigma;
      if (!calibrated) {
        messages_.push_back(std::string(TriadName(triad)) +
                            ": pose-to-pose noise is unknown and not included in the prediction; "
                            "state `noise: { excess: { sigma: … } }` if you know it");
      }
    }
  }
  if (calibrate_.triads[Triad::kGyroscope].enabled) {
    TRUETRIAD_RETURN_IF_ERROR(ChooseTurns(options, calibrated));
  }
  if (calibrated) {
    for (const PoseResidual& residual : calibrated->quality.pose_residuals) {
      weights_[{residual.pose, residual.triad}] = std::max(residual.weight, kRejectedWeight);
    }
  }
  return {};
}

// How well a turn is known: by the noise inside the rests, which adds up over it.
Status PlanProblem::ChooseTurns(const PlanOptions& options,
                                const std::optional<Calibration>& calibrated) {
  const Triad triad = Triad::kGyroscope;
  const TriadOptions& sensor = calibrate_.triads[triad];
  const auto stream =
      std::find_if(measured_.streams.begin(), measured_.streams.end(), [](const auto& candidate) {
        return candidate.triad == Triad::kGyroscope;
      });
  turns_.duration_s = options.turn_s;
  turns_.sigma_rad = options.turn_sigma_rad;
  if (calibrated && turns_.sigma_rad == 0.0) {
    turns_.sigma_rad = calibrated->sensors[triad]->noise.turn_excess_sigma_rad;
  }
  turns_.rate_hz = stream->rate_hz > 0.0 ? stream->rate_hz : kPlannedRateHz;
  if (!stream->noise_sigma_raw.isZero(0.0)) {
    turns_.reading_sigma_raw = ReadingSigma(*stream);
    return {};
  }
  Eigen::Vector3d density_raw = Eigen::Vector3d::Zero();
  if (sensor.allan) {
    density_raw = sensor.allan->white_density_raw;
  } else if (sensor.noise_sigma_raw && options.rest_s > 0.0) {
    density_raw = *sensor.noise_sigma_raw * std::sqrt(options.rest_s);
  } else {
    return BadInputError(
        "gyroscope: the σ of a turn depends on the length of the rest that `noise: { sigma: … }` "
        "is for; add that length, as in `plan: { rest_s: 5 }` (s)");
  }
  stream->rate_hz = kPlannedRateHz;
  stream->noise_sigma_raw = density_raw * std::sqrt(kPlannedRateHz);
  turns_.reading_sigma_raw = stream->noise_sigma_raw;
  return {};
}

// About each axis, roughly: what the noise of a pose leaves of its attitude.
double PlanProblem::AttitudeSigma() const {
  double variance = attitude_sigma_rad_.squaredNorm() / 3.0;
  if (calibrate_.attitudes.kind == AttitudeKind::kGiven) return std::sqrt(variance);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!nominal_.models[triad]) continue;
    const Eigen::Matrix3d correction = nominal_.models[triad]->Correction();
    const TriadOptions& sensor = calibrate_.triads[triad];
    Eigen::Matrix3d covariance = rest_covariance_[triad];
    if (sensor.noise_sigma_raw) covariance = sensor.noise_sigma_raw->cwiseAbs2().asDiagonal();
    const double share =
        ((correction * covariance * correction.transpose()).trace() / 3.0 + excess_[triad]) /
        WorldVector(triad, nominal_.reference).squaredNorm();
    variance = std::max(variance, share);
  }
  return std::sqrt(variance);
}

std::vector<ProgramPose> PlanProblem::OrderedForGyroscope(
    const std::vector<ProgramPose>& poses) const {
  return OrderForGyroscope(poses,
                           turns_,
                           *nominal_.models[Triad::kGyroscope],
                           AttitudeSigma(),
                           has_heading_,
                           calibrate_.triads[Triad::kGyroscope].asymmetry == Wanted::kYes);
}

PoseSet PlanProblem::ExactReadings(const std::vector<ProgramPose>& poses) const {
  PoseSet set = measured_;
  AppendReadings(poses, &set);
  return set;
}

void PlanProblem::AppendReadings(const std::vector<ProgramPose>& poses, PoseSet* set) const {
  const ProgramPose* before = nullptr;
  for (const ProgramPose& planned : poses) {
    if (has_gyroscope() && before != nullptr) {
      set->moves.push_back(ExactMove(before->world_from_body.normalized(),
                                     planned.world_from_body.normalized(),
                                     turns_,
                                     *nominal_.models[Triad::kGyroscope],
                                     *nominal_.models[Triad::kAccelerometer],
                                     WorldVector(Triad::kAccelerometer, nominal_.reference)));
      set->moves.back().from = set->poses.size() - 1;
    }
    before = &planned;
    StaticPose pose;
    pose.number = set->poses.empty() ? 1 : set->poses.back().number + 1;
    pose.end_ns = static_cast<std::int64_t>(std::llround(rest_s_ * 1e9));
    pose.temperature_degc = planned.temperature_degc;
    const Eigen::Quaterniond world_from_body = planned.world_from_body.normalized();
    for (const Triad triad : kPlannedTriads) {
      if (!nominal_.models[triad]) continue;
      // A gyroscope feels nothing at rest.
      Eigen::Vector3d world = Eigen::Vector3d::Zero();
      if (triad != Triad::kGyroscope) world = WorldVector(triad, nominal_.reference);
      TriadPose reading;
      reading.samples = kRestSamples;
      reading.mean_raw = nominal_.models[triad]->RawFromTruth(world_from_body.conjugate() * world);
      reading.mean_covariance_raw = rest_covariance_[triad];
      reading.has_covariance = true;
      pose.triads[triad] = reading;
    }
    if (calibrate_.attitudes.kind == AttitudeKind::kGiven) {
      pose.attitude = AttitudeReference{world_from_body, attitude_sigma_rad_};
    } else if (calibrate_.attitudes.kind == AttitudeKind::kSixFace) {
      pose.face_up = FaceUp(world_from_body);
    }
    set->poses.push_back(pose);
  }
}

// As the nominal unit would have been held.
std::vector<ProgramPose> PlanProblem::MeasuredAttitudes() const {
  std::vector<ProgramPose> poses;
  for (const PoseNode& node : graph_.nodes) {
    ProgramPose& pose = poses.emplace_back();
    pose.world_from_body = node.rotation();
    if (node.kind == PoseKind::kDirection) {
      const Eigen::Vector3d world =
          WorldVector(node.observations.front().triad, nominal_.reference);
      pose.world_from_body = RotationBetween(node.direction(), world);
    }
    pose.temperature_degc = node.temperature_degc;
  }
  return poses;
}

Status PlanProblem::Rehearse(const std::vector<ProgramPose>& poses) const {
  CalibrateOptions options = calibrate_;
  for (TriadOptions& sensor : options.triads) sensor.excess = ExcessNoise::kNone;
  options.robust.enabled = false;
  options.cross_validation_folds = 0;
  options.limits = {};
  options.initialise.only = false;
  // What was measured is the real unit's, which may be far from the nominal one: both together are
  // no unit. Rehearsed are its attitudes.
  PoseSet readings = measured_;
  readings.poses.clear();
  readings.moves.clear();
  AppendReadings(MeasuredAttitudes(), &readings);
  AppendReadings(poses, &readings);
  TRUETRIAD_RETURN_IF_ERROR(CheckPoseCounts(readings, options));
  const auto summary = Calibrate(readings, options);
  TRUETRIAD_RETURN_IF_ERROR(summary);
  if (summary->calibration.IsUsable()) return {};
  return NotEnoughError(
      "start values are unobservable even from noise-free readings of these poses (too few "
      "directions?); allow more poses or other rotations");
}

// Nodes with their weights and attitudes, in order; a pose that saw no wanted triad has none.
std::vector<PoseNode> PlanProblem::Nodes(const PoseSet& poses) const {
  PoseGraph graph;
  auto nodes = BuildNodes(poses, calibrate_, source_);
  CHECK(nodes) << nodes.error().message;  // the measured poses have been accepted before
  graph.nodes = *std::move(nodes);
  graph.layout = graph_.layout;
  graph.shared = graph_.shared;
  SetStartAttitudes(nominal_, &graph);
  for (PoseNode& node : graph.nodes) {
    for (Observation& observation : node.observations) {
      if (observation.rest_covariance.isZero(0.0)) {
        observation.rest_covariance = rest_covariance_[observation.triad];
      }
      const auto weight = weights_.find({node.number, observation.triad});
      if (weight != weights_.end()) observation.weight = weight->second;
      const Eigen::Matrix3d& S = nominal_.models[observation.triad]->sensitivity;
      observation.variance =
          observation.rest_covariance + excess_[observation.triad] * S * S.transpose();
    }
  }
  return graph.nodes;
}

std::vector<PoseNode> PlanProblem::PlannedNodes(const std::vector<ProgramPose>& poses) const {
  PoseSet set = ExactReadings(poses);
  set.poses.erase(set.poses.begin(),
                  set.poses.begin() + static_cast<std::ptrdiff_t>(measured_.poses.size()));
  set.moves.clear();
  return Nodes(set);
}

std::vector<InformationRows> PlanProblem::Rows(const std::vector<ProgramPose>& poses) const {
  const Eigen::MatrixXd to_free = graph_.layout.basis * scale_.asDiagonal();
  std::vector<InformationRows> rows;
  rows.reserve(poses.size());
  PoseResidual12 residual;
  PoseSharedJacobian shared_jacobian;
  PoseStateJacobian tangent_jacobian;
  for (const PoseNode& node : PlannedNodes(poses)) {
    node.Evaluate(graph_.layout,
                  graph_.shared.data(),
                  node.state.data(),
                  &residual,
                  &shared_jacobian,
                  &tangent_jacobian);
    const PoseRowMatrix root = node.SquareRootInformation();
    // What the attitude cannot absorb: the whitened rows across the range of its Jacobian.
    Eigen::MatrixXd whitened = Times(Times(root, shared_jacobian), to_free);
    if (node.tangent_size() > 0) whitened = InFrameOf(Times(root, tangent_jacobian), whitened);
    rows.emplace_back(whitened.bottomRows(node.row_count() - node.tangent_size()));
  }
  return rows;
}

Eigen::MatrixXd PlanProblem::Regularised() const {
  Eigen::MatrixXd information = known_;
  information.diagonal().array() += 1.0 / (kAnything * kAnything);
  return information;
}

Eigen::VectorXd PlanProblem::Sigmas(const Eigen::MatrixXd& information) const {
  const Cholesky factor(information);
  if (factor.is_positive() && factor.ReciprocalCondition() > kWellConditioned) {
    // Everything is determined: many times as fast as its eigenvectors.
    return factor.SolveLower(quantity_rows_.transpose()).colwise().norm();
  }
  const SymmetricEigen solver = EigenOfSymmetric(information);
  const double least = kRounding * std::max(solver.values.maxCoeff(), 1.0);
  Eigen::VectorXd sigmas(static_cast<Eigen::Index>(quantities_.size()));
  for (Eigen::Index q = 0; q < sigmas.size(); ++q) {
    const Eigen::VectorXd along = TransposeTimesVector(
        solver.vectors, quantities_[static_cast<std::size_t>(q)].row.transpose());
    double variance = 0.0;
    for (Eigen::Index i = 0; i < along.size(); ++i) {
      const double share = along[i] * along[i];
      if (solver.values[i] > least) {
        variance += share / solver.values[i];
      } else if (share > 1e-12 * along.squaredNorm()) {
        variance = std::numeric_limits<double>::infinity();
      }
    }
    sigmas[q] = std::sqrt(variance);
  }
  return sigmas;
}

std::vector<PlannedNoise> PlanProblem::Noise(const std::vector<ProgramPose>& poses) const {
  std::vector<PlannedNoise> all;
  const std::vector<PoseNode> nodes = PlannedNodes(poses);
  // All planned poses have the same.
  for (const Observation& observation : nodes.front().observations) {
    PlannedNoise& planned = all.emplace_back();
    planned.triad = observation.triad;
    planned.unit = measured_.Find(observation.triad)->unit.name;
    planned.noise.sigma = observation.rest_covariance.diagonal().cwiseSqrt();
    planned.noise.source = source_[observation.triad];
    planned.noise.excess_sigma = std::sqrt(excess_[observation.triad]);
    if (observation.triad == Triad::kGyroscope) {
      planned.noise.turn_excess_sigma_rad = turns_.sigma_rad;
    }
  }
  return all;
}

double PlanProblem::RestSeconds() const {
  if (rest_s_ > 0.0 || measured_.poses.empty()) return rest_s_;
  std::vector<double> durations_s;
  for (const StaticPose& pose : measured_.poses) durations_s.push_back(pose.duration_s());
  return Median(durations_s);
}

PoseGraph PlanProblem::GraphWith(const std::vector<ProgramPose>& poses) const {
  PoseGraph graph = graph_;
  if (!has_gyroscope()) {
    for (PoseNode& node : PlannedNodes(poses)) graph.nodes.push_back(node);
    return graph;
  }
  const PoseSet set = ExactReadings(poses);
  graph.nodes = Nodes(set);
  BuildIncrements(set, nominal_, &graph);
  for (IncrementEdge& edge : graph.increments) {
    edge.variance = edge.increment.covariance +
                    turns_.sigma_rad * turns_.sigma_rad * Eigen::Matrix3d::Identity();
  }
  return graph;
}

Eigen::MatrixXd PlanProblem::Information(const std::vector<ProgramPose>& poses) const {
  Eigen::MatrixXd information = known_;
  if (has_gyroscope()) {
    const ReducedSystem system(GraphWith(poses));
    information = scale_.asDiagonal() * system.information() * scale_.asDiagonal();
    return information;
  }
  for (const InformationRows& rows : Rows(poses)) information.noalias() += rows.transpose() * rows;
  return information;
}

PresentedSolution PlanProblem::Present(const Eigen::MatrixXd& free_covariance) const {
  PresentedSolution solution = SolvedFrame(graph_, free_covariance);
  StateInGauge(calibrate_.gauge, LeadingTriad(calibrate_), LeadingAxisSign(calibrate_), &solution);
  return solution;
}

void PlanProblem::FindQuantities() {
  const Eigen::Index free = graph_.layout.free_size();
  const PresentedSolution solution = Present(Eigen::MatrixXd::Zero(free, free));
  const Eigen::MatrixXd rows = solution.from_free * scale_.asDiagonal();
  const auto row_of = [&](const std::string& name) -> Eigen::RowVectorXd {
    const auto& names = solution.covariance.parameters;
    return rows.row(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const auto add = [&](const std::string& group,
                       const std::string& axes,
                       const std::string& unit,
                       double typical,
                       const Eigen::RowVectorXd& row) {
    if (row.isZero(0.0)) return;  // held, or fixed by the gauge
    quantities_.push_back({axes.empty() ? group : group + "." + axes, group, unit, typical, row});
  };
  for (const Triad triad : kPlannedTriads) {
    if (!solution.models[triad]) continue;
    const std::string sensor(TriadName(triad));
    // By sensing axis, whatever body axis it was mounted along; as limits are judged.
    const Eigen::Matrix3d& S = solution.models[triad]->sensitivity;
    const Eigen::Matrix3d map = NearestAxisMap(S);
    const Eigen::Vector3d gain = (S * map.transpose()).diagonal();
    const auto entry = [&](int row, int col) -> Eigen::RowVectorXd {
      Eigen::Index from = 0;
      map.row(col).cwiseAbs().maxCoeff(&from);
      return row_of(sensor + ".sensitivity." + kAxisLetters[static_cast<std::size_t>(row)] +
                    kAxisLetters[static_cast<std::size_t>(from)]) /
             gain[row];
    };
    const bool turns = triad == Triad::kGyroscope;
    const double signal = turns ? 1.0 : WorldVector(triad, nominal_.reference).norm();
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, kAxisLetters[static_cast<std::size_t>(i)]);
      add(sensor + ".bias",
          axis,
          std::string(TruthUnitName(triad)),
          signal,
          row_of(sensor + ".bias." + axis) / gain[i]);
    }
    for (int i = 0; i < 3; ++i) {
      add(sensor + ".scale_error", axis, "", 1.0, entry(i, i));
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (i == j) continue;
        add(sensor + ".misalignment_rad",
            std::string(1, kAxisLetters[static_cast<std::size_t>(i)]) +
                kAxisLetters[static_cast<std::size_t>(j)],
            "rad",
            1.0,
            entry(i, j));
      }
    }
    for (const std::string& name : solution.covariance.parameters) {
      const auto term = ParameterName::Parse(name);
      if (!term || term->triad != triad) continue;
      const std::string group = name.substr(0, name.rfind('.'));
      const std::string axes = name.substr(name.rfind('.') + 1);
      if (term->kind == ParameterKind::kGSensitivity) {
        add(group,
            axes,
            "rad/s/(m/s^2)",
            1.0 / nominal_.reference[kGravity],
            row_of(name) / gain[term->row]);
      } else if (term->kind == ParameterKind::kAsymmetry) {
        add(group, axes, "", 1.0, row_of(name));
      } else if (term->kind == ParameterKind::kQuadratic && !turns) {
        // As a share of the signal.
        add(group, axes, "", 1.0, row_of(name) * gain[term->row] * signal);
      }
      if (!term->is_thermal()) continue;
      const ThermalScale& scale = graph_.layout.thermal_scale;
      const bool is_bias = term->kind != ParameterKind::kSensitivity;
      const std::string truth(TruthUnitName(triad));
      std::string unit = is_bias ? truth : "1";
      double typical = is_bias ? signal : 1.0;
      switch (term->kind) {
        case ParameterKind::kRateLinear:
          unit += " s/degC";
          typical /= scale.rate_degcps;
          break;
        case ParameterKind::kRateQuadratic:
          unit += " s^2/degC^2";
          typical /= scale.rate_degcps * scale.rate_degcps;
          break;
        case ParameterKind::kRateCross:
          unit += " s/degC^2";
          typical /= scale.rate_degcps * scale.half_range_degc;
          break;
        default:
          unit += "/degC";
          if (term->power > 1) unit.append("^").append(std::to_string(term->power));
          typical /= std::pow(scale.half_range_degc, term->power);
      }
      add(group, axes, unit, typical, row_of(name) / gain[term->row]);
    }
  }
  const auto& names = solution.covariance.parameters;
  for (const auto& [name, unit, typical] :
       {std::tuple("reference.gravity_mps2", "m/s^2", nominal_.reference[kGravity]),
        std::tuple("reference.field_ut", "uT", nominal_.reference[kField]),
        std::tuple("reference.dip_rad", "rad", 1.0),
        std::tuple("reference.heading_rad", "rad", 1.0)}) {
    if (std::find(names.begin(), names.end(), name) == names.end()) continue;
    add(name, "", unit, typical, row_of(name));
  }
  quantity_rows_.resize(static_cast<Eigen::Index>(quantities_.size()), free);
  for (std::size_t q = 0; q < quantities_.size(); ++q) {
    quantity_rows_.row(static_cast<Eigen::Index>(q)) = quantities_[q].row;
  }
}

}  // namespace truetriad
