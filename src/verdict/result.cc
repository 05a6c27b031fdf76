// SPDX-License-Identifier: Apache-2.0
#include "verdict/result.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "model/mechanisms.h"
#include "problem/lay_out.h"
#include "problem/start_values.h"
#include "truetriad/math/rotation.h"
#include "truetriad/model/calibration.h"
#include "verdict/limits.h"
#include "verdict/quality.h"

namespace truetriad {
namespace {

// A sensor's parameters with their σ, without its noise.
TriadCalibration SensorOf(Triad triad, const PoseSet& poses, const PresentedSolution& solution) {
  TriadCalibration sensor = InUnits(triad, poses);
  sensor.model = *solution.models[triad];
  sensor.thermal = solution.thermal[triad];
  if (triad == Triad::kGyroscope) sensor.g_sensitivity = solution.g_sensitivity;
  const int at = PlaceOf(solution.covariance, {triad, ParameterKind::kBias, 0, 0, 0});
  const Eigen::VectorXd variance = solution.covariance.matrix.diagonal().segment(at, 12);
  for (int i = 0; i < 3; ++i) {
    sensor.bias_sigma[i] = std::sqrt(std::max(variance[i], 0.0));
    for (int j = 0; j < 3; ++j) {
      sensor.sensitivity_sigma(i, j) = std::sqrt(std::max(variance[3 + 3 * i + j], 0.0));
    }
  }
  const auto term_sigma = [&](ParameterKind kind) -> std::optional<Eigen::Vector3d> {
    const int place = PlaceOf(solution.covariance, {triad, kind, 0, 0, 0});
    if (place < 0) return std::nullopt;
    return solution.covariance.matrix.diagonal().segment<3>(place).cwiseMax(0.0).cwiseSqrt();
  };
  for (const AxisTermInfo& info : kAxisTerms) {
    sensor.axis_term_sigma[info.term] = term_sigma(info.kind);
  }
  return sensor;
}

}  // namespace

Eigen::Matrix3d MountingOf(const CalibrateOptions& options,
                           Triad triad,
                           const Eigen::Matrix3d& sensitivity) {
  const double sign = triad == Triad::kAccelerometer ? LeadingAxisSign(options) : 1.0;
  return options.triads[triad].mounting.value_or(NearestAxisMap(sign * sensitivity));
}

TriadCalibration InUnits(Triad triad, const PoseSet& poses) {
  TriadCalibration sensor;
  const StreamSummary* stream = poses.Find(triad);
  sensor.input_unit = stream != nullptr ? stream->unit.name : "";
  sensor.output_unit = std::string(TruthUnitName(triad));
  return sensor;
}

void StateReference(const CalibrateOptions& options,
                    const PoseGraph& graph,
                    ReferenceValues* stated) {
  const SharedLayout& layout = graph.layout;
  const ReferenceOptions& wanted = options.reference;
  const ReferenceVector reference = graph.reference();
  stated->gravity_mps2 = reference[kGravity];
  if (options.attitudes.unknown_fixture_rotation) {
    // The rotation of world vectors: v_fixture = R_level^T Exp(-tilt) Rz(heading) v_world.
    const Eigen::Vector3d tilt(reference[kFixtureTilt], reference[kFixtureTilt + 1], 0.0);
    const Eigen::Quaterniond q = graph.level_from_fixture.conjugate() * RotationExp(-tilt) *
                                 RotationExp({0.0, 0.0, reference[kHeading]});
    stated->fixture_from_world = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  }
  if (wanted.gravity_mps2.sigma > 0.0) stated->gravity_sigma_mps2 = wanted.gravity_mps2.sigma;
  if (!options.triads[Triad::kMagnetometer].enabled) return;
  const bool field_free = layout.IsFree(layout.reference + kField);
  const bool dip_free = layout.IsFree(layout.reference + kDip);
  stated->field_ut = reference[kField];
  stated->field_nominal = !wanted.field_ut.known() && !field_free;
  stated->field_estimated = field_free || dip_free;
  // A dip that is neither free nor known is not stated: it is a convention of the graph.
  if (dip_free) {
    stated->dip_rad = reference[kDip];
  } else if (wanted.dip_rad.known()) {
    stated->dip_rad = *wanted.dip_rad.value;
  }
}

void StateSolution(const CalibrateOptions& options,
                   const PoseSet& poses,
                   const PresentedSolution& solution,
                   const PerTriad<TriadNoise>& noise,
                   Calibration* calibration) {
  calibration->covariance = solution.covariance;
  for (const Triad triad : kTriads) {
    if (!options.triads[triad].enabled) continue;
    TriadCalibration& sensor =
        calibration->sensors[triad].emplace(SensorOf(triad, poses, solution));
    sensor.noise = noise[triad];
    sensor.mounting = MountingOf(options, triad, sensor.model.sensitivity);
  }
}

Status Conclude(const CalibrateOptions& options, const PoseSet& poses, Calibration* calibration) {
  for (Finding& finding : calibration->findings) {
    if (finding.IsLeftStanding() && Acts(Mechanism::kLeftStanding)) finding.As(Severity::kRefusal);
  }
  calibration->outcome = OutcomeOf(calibration->findings);
  if (!calibration->IsUsable()) {
    calibration->covariance = NamedCovariance();
    calibration->sensors = {};
    return {};
  }
  auto limits = JudgeLimits(*calibration, poses, options.limits);
  if (!limits) return limits.error();
  if (limits->empty() && !options.limits.limits.empty()) {
    return Error(ErrorCode::kInvalidExperiment,
                 "limits: this calibration has none of the limited quantities; state limits of "
                 "calibrated sensors")
        .About("limits");
  }
  calibration->quality.limits = std::move(*limits);
  if (!calibration->quality.limits.empty()) {
    calibration->within_limits = std::all_of(calibration->quality.limits.begin(),
                                             calibration->quality.limits.end(),
                                             [](const LimitCheck& check) { return check.pass; });
  }
  return {};
}

}  // namespace truetriad
