// SPDX-License-Identifier: Apache-2.0
#include "planning/plan_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <glog/logging.h>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "model/attitude_sets.h"
#include "noise/components.h"
#include "problem/graph_builder.h"
#include "problem/lay_out.h"
#include "solve/reduced_system.h"
#include "start/start.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Eigenvalues of the information below this share of the largest are rounding and count as zero.
constexpr double kRoundingShare = 1e-14;
// If the inverse condition number is larger, an inverse matrix has at least six correct digits.
constexpr double kWellConditioned = 1e-10;
// The number of samples of a planned rest. It is so large that the last sampling interval adds
// nothing to the rest's length.
constexpr std::int64_t kRestSamples = 1'000'000'000;

std::string FaceUp(const Eigen::Quaterniond& world_from_body) {
  const Eigen::Vector3d up = world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return std::string(up[axis] < 0.0 ? "-" : "+") + AxisLetter(axis);
}

// A few poses that together cover every planned temperature and every face of a six-face block.
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
  problem.options_ = options;
  problem.measured_ = measured;
  problem.has_heading_ = options.calibrate.attitudes.kind == AttitudeKind::kGiven ||
                         options.calibrate.triads[Triad::kMagnetometer].enabled;
  for (const Triad triad : kTriads) {
    if (!options.calibrate.triads[triad].enabled || measured.Find(triad) != nullptr) continue;
    if (!measured.poses.empty()) {
      return Error(ErrorCode::kMissingSensor,
                   {measured.source},
                   "the " + std::string(TriadName(triad)) +
                       " is enabled but missing from the recording; record it, or remove it from "
                       "`sensors:`");
    }
    StreamSummary stream;
    stream.triad = triad;
    stream.unit = options.units[triad];
    problem.measured_.streams.push_back(stream);
  }
  TRUETRIAD_RETURN_IF_ERROR(problem.ChooseNominal());
  TRUETRIAD_RETURN_IF_ERROR(problem.ChooseLayout());
  const ReducedSystem system(problem.graph_);
  problem.scale_ = system.scale();
  problem.known_ = ScaledBothSides(problem.scale_, system.information());
  problem.FindQuantities();
  return problem;
}

// Lays out the parameters for all planned poses: every face of a block has its tilt, and the
// temperature range that scales temperature terms includes all temperatures.
Status PlanProblem::ChooseLayout() {
  TRUETRIAD_RETURN_IF_ERROR(BuildNodes(measured_, calibrate(), source_));
  TRUETRIAD_ASSIGN_OR_RETURN(
      graph_.nodes,
      BuildNodes(WithReadings(measured_, SpanningPoses(options_)), calibrate(), source_));
  LayOutParameters(calibrate(), nominal_, &graph_);
  if (graph_.layout.free_size() == 0) {
    return Error(ErrorCode::kNothingToEstimate,
                 "every parameter is fixed by `fixed:`; nothing is left to plan for")
        .About("sensors");
  }
  AddPriors(calibrate(), &graph_);
  graph_ = GraphOf(measured_);
  return {};
}

PoseSet PlanProblem::NoReadings() const {
  PoseSet set = measured_;
  set.poses.clear();
  set.moves.clear();
  return set;
}

PoseSet PlanProblem::WithReadings(PoseSet set, const std::vector<ProgramPose>& poses) const {
  const ProgramPose* before = nullptr;
  for (const ProgramPose& planned : poses) {
    const Eigen::Quaterniond world_from_body = planned.world_from_body.normalized();
    if (has_gyroscope() && before != nullptr) {
      set.moves.push_back(ExactMove(before->world_from_body.normalized(),
                                    world_from_body,
                                    turns_,
                                    *nominal_.models[Triad::kAccelerometer],
                                    WorldVector(Triad::kAccelerometer, nominal_.reference)));
      set.moves.back().from = set.poses.size() - 1;
    }
    before = &planned;
    // A planned pose must not have the number of a measured one.
    const std::vector<StaticPose>& last = (set.poses.empty() ? measured_ : set).poses;
    StaticPose pose;
    pose.number = last.empty() ? 1 : last.back().number + 1;
    pose.end_ns = static_cast<std::int64_t>(std::llround(options_.rest_s * 1e9));
    pose.temperature_degc = planned.temperature_degc;
    for (const Triad triad : kTriads) {
      if (!nominal_.models[triad]) continue;
      // At rest the rate is zero.
      Eigen::Vector3d world = Eigen::Vector3d::Zero();
      if (triad != Triad::kGyroscope) world = WorldVector(triad, nominal_.reference);
      TriadPose reading;
      reading.samples = kRestSamples;
      reading.mean_raw = nominal_.models[triad]->RawFromTruth(world_from_body.conjugate() * world);
      reading.mean_covariance_raw = rest_covariance_[triad];
      reading.has_covariance = true;
      pose.triads[triad] = reading;
    }
    if (calibrate().attitudes.kind == AttitudeKind::kGiven) {
      pose.attitude = AttitudeReference{world_from_body, options_.attitude_sigma_rad};
    } else if (calibrate().attitudes.kind == AttitudeKind::kSixFace) {
      pose.face_up = FaceUp(world_from_body);
    }
    set.poses.push_back(std::move(pose));
  }
  return set;
}

int PlanProblem::LeastPoses() const {
  std::vector<ProgramPose> poses;
  while (!CheckPoseCounts(WithReadings(measured_, poses), calibrate())) poses.emplace_back();
  return std::max(static_cast<int>(poses.size()), 1);
}

Status PlanProblem::Rehearse(const std::vector<ProgramPose>& poses) const {
  CalibrateOptions options = calibrate();
  for (TriadOptions& sensor : options.triads) sensor.excess = ExcessNoise::kNone;
  options.robust.enabled = false;
  options.cross_validation_folds = 0;
  options.limits = {};
  options.initialise.only = false;
  // The real unit may differ much from the nominal one, and then no calibration fits readings of
  // both. Readings that the nominal unit would give in the measured attitudes therefore replace the
  // measured readings.
  std::vector<ProgramPose> measured;
  for (const PoseNode& node : graph_.nodes) {
    ProgramPose& pose = measured.emplace_back();
    pose.world_from_body = node.rotation();
    if (node.kind == PoseKind::kDirection) {
      pose.world_from_body = RotationBetween(
          node.direction(), WorldVector(node.observations.front().triad, nominal_.reference));
    }
    pose.temperature_degc = node.temperature_degc;
  }
  const PoseSet readings = WithReadings(WithReadings(NoReadings(), measured), poses);
  TRUETRIAD_RETURN_IF_ERROR(CheckPoseCounts(readings, options));
  TRUETRIAD_ASSIGN_OR_RETURN(const auto summary, Calibrate(readings, options));
  if (summary.calibration.IsUsable()) return {};
  return Error(ErrorCode::kNotEnoughData,
               "even noise-free readings of these poses give no usable calibration (too few "
               "directions?); allow more poses or other rotations");
}

PoseGraph PlanProblem::GraphOf(const PoseSet& poses) const {
  PoseGraph graph = graph_;
  auto nodes = BuildNodes(poses, calibrate(), source_);
  CHECK(nodes) << nodes.error().message;  // cannot fail: the measured poses were accepted before
  graph.nodes = *std::move(nodes);
  SetStartAttitudes(nominal_, &graph);
  for (PoseNode& node : graph.nodes) {
    for (Observation& observation : node.observations) {
      if (source_[observation.triad] == NoiseSource::kResidual ||
          observation.rest_covariance.isZero(0.0)) {
        observation.rest_covariance = rest_covariance_[observation.triad];
      }
      const auto weight = weights_.find({node.number, observation.triad});
      if (weight != weights_.end()) observation.weight = weight->second;
    }
  }
  if (has_gyroscope()) BuildIncrements(poses, nominal_, &graph);
  ApplyExcess(excess_, &graph);
  return graph;
}

PoseGraph PlanProblem::GraphWith(const std::vector<ProgramPose>& poses) const {
  return GraphOf(WithReadings(measured_, poses));
}

std::vector<InformationRows> PlanProblem::Rows(const std::vector<ProgramPose>& poses) const {
  const Eigen::MatrixXd to_free = graph_.layout.basis * scale_.asDiagonal();
  std::vector<InformationRows> rows;
  rows.reserve(poses.size());
  PoseResidual12 residual;
  PoseSharedJacobian shared_jacobian;
  PoseStateJacobian tangent_jacobian;
  for (const PoseNode& node : GraphOf(WithReadings(NoReadings(), poses)).nodes) {
    node.Evaluate(graph_.layout,
                  graph_.shared.data(),
                  node.state.data(),
                  &residual,
                  &shared_jacobian,
                  &tangent_jacobian);
    const PoseRowMatrix root = node.SquareRootInformation();
    // Only the part orthogonal to the attitude's Jacobian counts: the attitude absorbs the rest.
    Eigen::MatrixXd whitened = Times(Times(root, shared_jacobian), to_free);
    if (node.tangent_size() > 0) whitened = InFrameOf(Times(root, tangent_jacobian), whitened);
    rows.emplace_back(whitened.bottomRows(node.row_count() - node.tangent_size()));
  }
  return rows;
}

Eigen::VectorXd PlanProblem::Sigmas(const Eigen::MatrixXd& information) const {
  const Cholesky factor(information);
  if (factor.is_positive() && factor.ReciprocalCondition() > kWellConditioned) {
    // If everything is determined, the Cholesky factor suffices; it is much faster than
    // eigenvectors.
    return factor.SolveLower(quantity_rows_.transpose()).colwise().norm();
  }
  const SymmetricEigen solver = EigenOfSymmetric(information);
  const double least = kRoundingShare * std::max(solver.values.maxCoeff(), 1.0);
  Eigen::VectorXd sigmas(static_cast<Eigen::Index>(quantities_.size()));
  for (Eigen::Index q = 0; q < sigmas.size(); ++q) {
    const Eigen::VectorXd along =
        TransposeTimesVector(solver.vectors, quantity_rows_.row(q).transpose());
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
  const PoseGraph graph = GraphOf(WithReadings(NoReadings(), {poses.front()}));
  for (const Observation& observation : graph.nodes.front().observations) {
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
  if (options_.rest_s > 0.0 || measured_.poses.empty()) return options_.rest_s;
  std::vector<double> durations_s;
  for (const StaticPose& pose : measured_.poses) durations_s.push_back(pose.duration_s());
  return Median(durations_s);
}

Eigen::MatrixXd PlanProblem::Information(const std::vector<ProgramPose>& poses) const {
  if (has_gyroscope()) {
    return ScaledBothSides(scale_, ReducedSystem(GraphWith(poses)).information());
  }
  Eigen::MatrixXd information = known_;
  for (const InformationRows& rows : Rows(poses)) information.noalias() += rows.transpose() * rows;
  return information;
}

PresentedSolution PlanProblem::Present(const Eigen::MatrixXd& free_covariance) const {
  PresentedSolution solution = SolvedFrame(graph_, free_covariance);
  StateInGauge(calibrate(), &solution);
  return solution;
}

}  // namespace truetriad
