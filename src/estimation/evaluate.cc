// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "estimation/parameter_name.h"
#include "truetriad/estimation/calibrate.h"
#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

// A sensor's model at the temperature of a pose, held at the ends of the calibrated range, and what
// the terms of the model are multiplied with there.
struct ModelAtPose {
  TriadModel<double> model;
  double tau_degc = 0.0;
  double rate_degcps = 0.0;
};

Result<ModelAtPose> ModelFor(const TriadCalibration& sensor,
                             const StaticPose& pose,
                             const std::string& source) {
  if (!sensor.thermal) return ModelAtPose{sensor.model, 0.0, 0.0};
  if (!pose.temperature_degc) {
    return BadInputError(source + ": pose " + std::to_string(pose.number) +
                         " has no temperature, but the calibration depends on it; give a recording "
                         "with a temperature column");
  }
  const double temperature = std::clamp(
      *pose.temperature_degc, sensor.thermal->range_degc[0], sensor.thermal->range_degc[1]);
  return ModelAtPose{
      ModelAtTemperature(sensor.model, *sensor.thermal, temperature, pose.temperature_rate_degcps),
      temperature - sensor.thermal->reference_degc,
      pose.temperature_rate_degcps};
}

// Derivative of the length of the truth by the reading: n^T C D^-1 with n its direction and D the
// slope of the readings by what the axes feel.
Eigen::RowVector3d LengthByReading(const TriadModel<double>& model, const Eigen::Vector3d& truth) {
  const Eigen::Vector3d slope = model.Slope(model.sensitivity * truth);
  return truth.normalized().transpose() * model.Correction() * slope.cwiseInverse().asDiagonal();
}

// Variance of |x| from the parameters: d|x| = -n^T C D^-1 (D dS x + u^2 dq + |u| da + db), u = S x.
double ParameterVariance(const Calibration& calibration,
                         Triad triad,
                         const ModelAtPose& at,
                         const Eigen::Vector3d& truth) {
  const NamedCovariance& covariance = calibration.covariance;
  const Eigen::Vector3d felt = at.model.sensitivity * truth;
  const Eigen::Vector3d slope = at.model.Slope(felt);
  const Eigen::RowVector3d weight = LengthByReading(at.model, truth);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(covariance.matrix.rows());
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance.parameters[i]);
    if (!name || name->triad != triad) continue;
    double factor = std::pow(at.tau_degc, name->power);
    if (name->kind == ParameterKind::kSensitivity) factor *= slope[name->row] * truth[name->col];
    if (name->kind == ParameterKind::kQuadratic) factor = felt[name->row] * felt[name->row];
    if (name->kind == ParameterKind::kAsymmetry) factor = std::abs(felt[name->row]);
    if (name->kind == ParameterKind::kRateLinear) factor = at.rate_degcps;
    if (name->kind == ParameterKind::kRateQuadratic) factor = at.rate_degcps * at.rate_degcps;
    if (name->kind == ParameterKind::kRateCross) factor = at.tau_degc * at.rate_degcps;
    gradient[static_cast<Eigen::Index>(i)] = -weight[name->row] * factor;
  }
  return gradient.dot(covariance.matrix * gradient);
}

}  // namespace

Result<EvaluationSummary> Evaluate(const Calibration& calibration, const PoseSet& poses) {
  if (!calibration.IsUsable()) {
    return BadInputError("this calibration is not usable (" +
                         std::string(OutcomeName(calibration.outcome)) +
                         "): there is nothing to evaluate");
  }
  EvaluationSummary summary;
  summary.poses = static_cast<int>(poses.poses.size());
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  PerTriad<double> squares{}, squares_before{}, predicted{};
  PerTriad<int> counts{};
  bool any = false;
  for (const Triad triad : kTriads) {
    const StreamSummary* stream = poses.Find(triad);
    if (!calibration.sensors[triad] || stream == nullptr) continue;
    any = true;
    if (stream->unit.name != calibration.sensors[triad]->input_unit) {
      return BadInputError(poses.source + ": the " + std::string(TriadName(triad)) + " is in " +
                           stream->unit.name + ", but the calibration takes " +
                           calibration.sensors[triad]->input_unit);
    }
  }
  if (!any) {
    return BadInputError(poses.source + ": holds none of the sensors that the calibration covers");
  }
  double angle_sum = 0.0;
  double angle_squares = 0.0;
  int angles = 0;
  for (const StaticPose& pose : poses.poses) {
    PerTriad<std::optional<Eigen::Vector3d>> corrected;
    bool is_clamped = false;
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      if (!calibration.sensors[triad] || !pose.triads[triad]) continue;
      const TriadCalibration& sensor = *calibration.sensors[triad];
      const Eigen::Vector3d reading = pose.triads[triad]->mean_raw;
      const Result<ModelAtPose> at = ModelFor(sensor, pose, poses.source);
      TRUETRIAD_RETURN_IF_ERROR(at);
      is_clamped = is_clamped ||
                   (sensor.thermal && (*pose.temperature_degc < sensor.thermal->range_degc[0] ||
                                       *pose.temperature_degc > sensor.thermal->range_degc[1]));
      const Eigen::Vector3d truth = at->model.TruthFromRaw(reading);
      corrected[triad] = truth;
      const double strength = triad == Triad::kAccelerometer
                                  ? calibration.reference.gravity_mps2
                                  : calibration.reference.field_ut.value_or(unknown);
      const StreamSummary* stream = poses.Find(triad);
      PoseResidual residual;
      residual.pose = pose.number;
      residual.triad = triad;
      residual.direction = truth.normalized();
      residual.norm_error = truth.norm() - strength;
      residual.norm_error_before =
          stream->unit.is_counts ? unknown : reading.norm() * stream->unit.truth_per_raw - strength;
      residual.residual = residual.norm_error * residual.direction;
      const Eigen::RowVector3d weight = LengthByReading(at->model, truth);
      const double excess = sensor.noise.excess_sigma;
      const Eigen::Matrix3d noise =
          pose.triads[triad]->has_covariance
              ? pose.triads[triad]->mean_covariance_raw
              : Eigen::Matrix3d(sensor.noise.sigma.cwiseAbs2().asDiagonal());
      const double variance = weight.dot(noise * weight.transpose()) + excess * excess +
                              ParameterVariance(calibration, triad, *at, truth);
      residual.normalized = std::abs(residual.norm_error) / std::sqrt(variance);
      summary.pose_residuals.push_back(residual);
      squares[triad] += residual.norm_error * residual.norm_error;
      squares_before[triad] += residual.norm_error_before * residual.norm_error_before;
      predicted[triad] += variance;
      ++counts[triad];
    }
    if (is_clamped) ++summary.clamped_poses;
    if (corrected[Triad::kAccelerometer] && corrected[Triad::kMagnetometer]) {
      const double cosine = corrected[Triad::kAccelerometer]->normalized().dot(
          corrected[Triad::kMagnetometer]->normalized());
      const double angle = std::acos(std::min(1.0, std::max(-1.0, cosine))) * 180.0 / M_PI;
      angle_sum += angle;
      angle_squares += angle * angle;
      ++angles;
    }
  }
  for (const Triad triad : kTriads) {
    if (counts[triad] == 0) continue;
    summary.norm_rms[triad] = std::sqrt(squares[triad] / counts[triad]);
    summary.predicted_rms[triad] = std::sqrt(predicted[triad] / counts[triad]);
    if (std::isfinite(squares_before[triad])) {
      summary.norm_rms_before[triad] = std::sqrt(squares_before[triad] / counts[triad]);
    }
  }
  if (angles > 1) {
    const double mean = angle_sum / angles;
    summary.angle_std_deg = std::sqrt(std::max(angle_squares / angles - mean * mean, 0.0));
  }
  return summary;
}

}  // namespace truetriad
