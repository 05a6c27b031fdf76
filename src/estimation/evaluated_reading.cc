// SPDX-License-Identifier: Apache-2.0
#include "estimation/evaluated_reading.h"

#include <algorithm>
#include <cmath>

#include "truetriad/model/thermal.h"

namespace truetriad {
namespace {

// d truth / d reading: C D^-1 with D the slope of the readings by what the axes feel.
Eigen::Matrix3d TruthByReading(const TriadModel<double>& model, const Eigen::Vector3d& truth) {
  const Eigen::Vector3d slope = model.Slope(model.sensitivity * truth);
  return model.Correction() * slope.cwiseInverse().asDiagonal();
}

// dx = -C D^-1 (D dS x + u^2 dq + |u| da + db + dG f), u = S x.
Eigen::Matrix3Xd TruthByParameters(const Calibration& calibration,
                                   Triad triad,
                                   const ModelAtPose& at,
                                   const Eigen::Vector3d& truth,
                                   const Eigen::Vector3d& force_mps2) {
  const NamedCovariance& covariance = calibration.covariance;
  const Eigen::Matrix3d by_reading = TruthByReading(at.model, truth);
  const Eigen::Vector3d felt = at.model.sensitivity * truth;
  const Eigen::Vector3d slope = at.model.Slope(felt);
  Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Zero(3, covariance.matrix.rows());
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance.parameters[i]);
    if (!name || name->triad != triad) continue;
    double factor = at.FactorOf(*name);
    if (name->kind == ParameterKind::kSensitivity) factor *= slope[name->row] * truth[name->col];
    if (name->kind == ParameterKind::kQuadratic) factor *= felt[name->row] * felt[name->row];
    if (name->kind == ParameterKind::kAsymmetry) factor *= std::abs(felt[name->row]);
    if (name->kind == ParameterKind::kGSensitivity) factor *= force_mps2[name->col];
    derivative.col(static_cast<Eigen::Index>(i)) = -factor * by_reading.col(name->row);
  }
  return derivative;
}

}  // namespace

double ModelAtPose::FactorOf(const ParameterName& name) const {
  switch (name.kind) {
    case ParameterKind::kBias:
    case ParameterKind::kSensitivity:
      return std::pow(tau_degc, name.power);
    case ParameterKind::kGSensitivity:
    case ParameterKind::kQuadratic:
    case ParameterKind::kAsymmetry:
      return 1.0;
    case ParameterKind::kRateLinear:
      return rate_degcps;
    case ParameterKind::kRateQuadratic:
      return rate_degcps * rate_degcps;
    case ParameterKind::kRateCross:
      return tau_degc * rate_degcps;
  }
  return 0.0;
}

ModelAtPose ModelAtTemperatureOf(const TriadCalibration& sensor,
                                 double temperature_degc,
                                 double rate_degcps) {
  if (!sensor.thermal) return {sensor.model, 0.0, 0.0, false};
  const ThermalTerms& thermal = *sensor.thermal;
  const double held = std::clamp(temperature_degc, thermal.range_degc[0], thermal.range_degc[1]);
  return {ModelAtTemperature(sensor.model, thermal, held, rate_degcps),
          held - thermal.reference_degc,
          rate_degcps,
          held != temperature_degc};
}

Result<ModelAtPose> ModelFor(const TriadCalibration& sensor,
                             const StaticPose& pose,
                             const std::string& source) {
  if (sensor.thermal && !pose.temperature_degc) {
    return BadInputError(source + ": pose " + std::to_string(pose.number) +
                         " has no temperature, but the calibration depends on it; give a recording "
                         "with a temperature column");
  }
  return ModelAtTemperatureOf(
      sensor, pose.temperature_degc.value_or(0.0), pose.temperature_rate_degcps);
}

Eigen::Matrix3d EvaluatedReading::Covariance(const Calibration& calibration) const {
  return noise + by_parameters * calibration.covariance.matrix * by_parameters.transpose();
}

Result<std::optional<EvaluatedReading>> EvaluateReading(
    const Calibration& calibration,
    Triad triad,
    const StaticPose& pose,
    const std::optional<Eigen::Vector3d>& force_mps2,
    const std::string& source) {
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  const std::optional<TriadPose>& seen = pose.triads[triad];
  if (!sensor || !seen || (sensor->g_sensitivity && !force_mps2)) {
    return std::optional<EvaluatedReading>();
  }
  const Result<ModelAtPose> at = ModelFor(*sensor, pose, source);
  TRUETRIAD_RETURN_IF_ERROR(at);
  const Eigen::Vector3d force = force_mps2.value_or(Eigen::Vector3d::Zero());
  Eigen::Vector3d reading = seen->mean_raw;
  if (sensor->g_sensitivity) reading -= *sensor->g_sensitivity * force;

  EvaluatedReading evaluated;
  evaluated.truth = at->model.TruthFromRaw(reading);
  evaluated.by_parameters = TruthByParameters(calibration, triad, *at, evaluated.truth, force);
  const Eigen::Matrix3d by_reading = TruthByReading(at->model, evaluated.truth);
  const Eigen::Matrix3d mean = seen->has_covariance
                                   ? seen->mean_covariance_raw
                                   : Eigen::Matrix3d(sensor->noise.sigma.cwiseAbs2().asDiagonal());
  const double excess = sensor->noise.excess_sigma;
  evaluated.noise =
      by_reading * mean * by_reading.transpose() + excess * excess * Eigen::Matrix3d::Identity();
  evaluated.is_clamped = at->is_clamped;
  return std::optional(std::move(evaluated));
}

}  // namespace truetriad
