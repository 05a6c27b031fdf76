// SPDX-License-Identifier: Apache-2.0
#include "calibrate/evaluated_poses.h"

#include <cmath>

#include "math/distributions.h"
#include "problem/moves.h"
#include "problem/observe.h"
#include "problem/parameter_name.h"
#include "truetriad/math/rotation.h"
#include "verdict/turn_errors.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

// d truth / d reading: C D^-1 with D the slope of the readings by what the axes feel.
Eigen::Matrix3d TruthByReading(const TriadModel<double>& model, const Eigen::Vector3d& truth) {
  const Eigen::Vector3d slope = model.Slope(model.sensitivity * truth);
  return model.Correction() * slope.cwiseInverse().asDiagonal();
}

ThermalState SameOnAllAxes(double degc, double rate_degcps) {
  return {Eigen::Vector3d::Constant(degc), Eigen::Vector3d::Constant(rate_degcps)};
}

// The sensor's model at the pose. Error (bad input): the model needs a temperature, and the pose
// has none.
Result<ModelAtPose> ModelFor(const TriadCalibration& sensor,
                             const StaticPose& pose,
                             const ThermalState* felt,
                             const std::string& source) {
  if (sensor.thermal && !pose.temperature_degc) {
    return Error(ErrorCode::kMissingTemperature,
                 {source},
                 "pose " + std::to_string(pose.number) +
                     " has no temperature, but the calibration needs one; give a recording "
                     "with a temperature column");
  }
  if (felt != nullptr) return ModelAtTemperatureOf(sensor, *felt);
  return ModelAtTemperatureOf(
      sensor, SameOnAllAxes(pose.temperature_degc.value_or(0.0), pose.temperature_rate_degcps));
}

// The derivatives of the rotation by the parameters that the covariance lists, in the convention of
// GyroIncrement.
Eigen::Matrix3Xd TurnByParameters(const NamedCovariance& covariance,
                                  const ModelAtPose& at,
                                  const GyroIncrement& turn) {
  Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Zero(3, covariance.matrix.rows());
  for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
    const auto name = ParameterName::Parse(covariance.parameters[i]);
    if (!name || name->triad != kGyroscope) continue;
    const int entry = 3 * name->col + name->row;
    Eigen::Vector3d column = turn.by_bias.col(name->row);
    if (name->kind == ParameterKind::kSensitivity) column = turn.by_sensitivity.col(entry);
    if (const auto term = InfoOf(name->kind).axis_term) {
      column = turn.by_axis_term[*term].col(name->row);
    }
    if (name->kind == ParameterKind::kGSensitivity) column = turn.by_g_sensitivity.col(entry);
    derivative.col(static_cast<Eigen::Index>(i)) = at.FactorOf(*name) * column;
  }
  return derivative;
}

// The gyroscope during a turn, at the mean temperature of the poses before and after it.
ModelAtPose ModelBetween(const TriadCalibration& sensor,
                         const StaticPose& first,
                         const StaticPose& second) {
  return ModelAtTemperatureOf(
      sensor,
      SameOnAllAxes(
          0.5 * (first.temperature_degc.value_or(0.0) + second.temperature_degc.value_or(0.0)),
          0.5 * (first.temperature_rate_degcps + second.temperature_rate_degcps)));
}

}  // namespace

double ModelAtPose::FactorOf(const ParameterName& name) const {
  const ParameterInfo& info = InfoOf(name.kind);
  if (info.rate) return truetriad::FactorOf(*info.rate, tau_degc[name.row], rate_degcps[name.row]);
  // For every kind except bias and sensitivity, the power is zero.
  return std::pow(tau_degc[name.row], name.power);
}

ModelAtPose ModelAtTemperatureOf(const TriadCalibration& sensor, const ThermalState& state) {
  if (!sensor.thermal) return {.model = sensor.model};
  const ThermalTerms& thermal = *sensor.thermal;
  ThermalState held = state;
  held.degc = state.degc.cwiseMax(thermal.range_degc[0]).cwiseMin(thermal.range_degc[1]);
  return {ModelAtTemperature(sensor.model, thermal, held),
          held.degc.array() - thermal.reference_degc,
          held.rate_degcps,
          held.degc != state.degc};
}

NamesOfTriad NamesOf(const NamedCovariance& covariance, Triad triad) {
  NamesOfTriad names;
  for (const std::string& text : covariance.parameters) {
    std::optional<ParameterName>& name = names.emplace_back(ParameterName::Parse(text));
    if (name && name->triad != triad) name.reset();
  }
  return names;
}

Eigen::Matrix3Xd TruthByParameters(const NamesOfTriad& names,
                                   const ModelAtPose& at,
                                   const Eigen::Vector3d& truth,
                                   const Eigen::Vector3d& force_mps2) {
  const Eigen::Matrix3d by_reading = TruthByReading(at.model, truth);
  const Eigen::Vector3d felt = at.model.sensitivity * truth;
  const Eigen::Vector3d slope = at.model.Slope(felt);
  Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(names.size()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::optional<ParameterName>& name = names[i];
    if (!name) continue;
    double factor = at.FactorOf(*name);
    if (name->kind == ParameterKind::kSensitivity) factor *= slope[name->row] * truth[name->col];
    if (const auto term = InfoOf(name->kind).axis_term) factor *= ValueOf(*term, felt[name->row]);
    if (name->kind == ParameterKind::kGSensitivity) factor *= force_mps2[name->col];
    derivative.col(static_cast<Eigen::Index>(i)) = -factor * by_reading.col(name->row);
  }
  return derivative;
}

Result<std::vector<ThermalState>> FeltAtPoses(const TriadCalibration& sensor,
                                              const PoseSet& poses) {
  std::vector<ThermalState> felt;
  const bool has_lags =
      sensor.thermal && (sensor.thermal->element_lag_s || sensor.thermal->rate_lag_s);
  if (!has_lags) return felt;
  const TemperatureTrack& track = poses.sweep.temperature;
  if (track.empty()) {
    return Error(ErrorCode::kDoesNotMatch,
                 {poses.source},
                 "the calibration depends on earlier temperatures (lag), which rests alone "
                 "do not record; evaluate it with "
                 "`--poses=sweep` on a recording in one attitude");
  }
  TemperatureFilter filter(*sensor.thermal);
  std::vector<ThermalState> along;
  for (std::size_t i = 0; i < track.time_s.size(); ++i) {
    along.push_back(filter.Next(track.time_s[i], track.degc[i]));
  }
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    ThermalState& mean = felt.emplace_back();
    const auto count = static_cast<double>(poses.sweep.last[k] - poses.sweep.first[k] + 1);
    for (std::size_t i = poses.sweep.first[k]; i <= poses.sweep.last[k]; ++i) {
      mean.degc += along[i].degc / count;
      mean.rate_degcps += along[i].rate_degcps / count;
    }
  }
  return felt;
}

Eigen::Matrix3d EvaluatedReading::Covariance(const Calibration& calibration) const {
  return noise + by_parameters * calibration.covariance.matrix * by_parameters.transpose();
}

Result<std::optional<EvaluatedReading>> EvaluateReading(
    const Calibration& calibration,
    Triad triad,
    const StaticPose& pose,
    const ThermalState* felt,
    const std::optional<Eigen::Vector3d>& force_mps2,
    const std::string& source) {
  const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
  const Boxed<TriadPose>& seen = pose.triads[triad];
  if (!sensor || !seen || (sensor->g_sensitivity && !force_mps2)) {
    return std::optional<EvaluatedReading>();
  }
  const Result<ModelAtPose> at = ModelFor(*sensor, pose, felt, source);
  TRUETRIAD_RETURN_IF_ERROR(at);
  const Eigen::Vector3d force = force_mps2.value_or(Eigen::Vector3d::Zero());
  Eigen::Vector3d reading = seen->mean_raw;
  if (sensor->g_sensitivity) reading -= *sensor->g_sensitivity * force;

  EvaluatedReading evaluated;
  evaluated.truth = at->model.TruthFromRaw(reading);
  evaluated.by_parameters =
      TruthByParameters(NamesOf(calibration.covariance, triad), *at, evaluated.truth, force);
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

double RootMeanSquareOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

std::optional<EvaluatedTurns> EvaluateTurns(
    const Calibration& calibration,
    const PoseSet& poses,
    const std::vector<std::optional<EvaluatedReading>>& vectors,
    const std::set<int>& left_out) {
  const std::optional<TriadCalibration>& gyroscope = calibration.sensors[kGyroscope];
  const std::optional<TriadCalibration>& accelerometer = calibration.sensors[Triad::kAccelerometer];
  if (!gyroscope || poses.Find(kGyroscope) == nullptr) return std::nullopt;
  const std::optional<TriadModel<double>> nominal = NominalGyroscope(poses);
  const Eigen::Vector3d sigma_raw = ReadingSigma(poses, gyroscope->model.sensitivity);
  std::vector<double> errors, nominal_errors;
  double expected = 0.0;
  for (const RecordedMove& recorded : poses.moves) {
    const auto& before = vectors[recorded.from];
    const auto& after = vectors[recorded.from + 1];
    if (recorded.fault || !before || !after) continue;
    if (left_out.contains(poses.poses[recorded.from + 1].number)) continue;
    const ModelAtPose at =
        ModelBetween(*gyroscope, poses.poses[recorded.from], poses.poses[recorded.from + 1]);
    GyroModel model{at.model};
    model.is_bent = gyroscope->axis_term_sigma.any();
    if (gyroscope->g_sensitivity) model.g_sensitivity = *gyroscope->g_sensitivity;
    const GyroMove move = MoveOf(recorded, accelerometer ? &accelerometer->model : nullptr);
    const GyroIncrement turn = IntegrateMove(move, model, sigma_raw, RateSampling::kInstantaneous);
    errors.push_back(TurnError(turn.rotation, before->truth, after->truth));
    if (nominal) {
      const GyroIncrement plain =
          IntegrateMove(move, {*nominal}, sigma_raw, RateSampling::kInstantaneous);
      nominal_errors.push_back(TurnError(plain.rotation, before->truth, after->truth));
    }

    // The error is after - R^T before, R the turn. An error d of the turn changes R^T before by
    // (R^T before) x d.
    const Eigen::Matrix3d back = turn.rotation.toRotationMatrix().transpose();
    const Eigen::Matrix3d by_turn = Skew(back * before->truth);
    const double excess = gyroscope->noise.turn_excess_sigma_rad;
    const Eigen::Matrix3d turn_noise =
        turn.covariance + excess * excess * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3Xd by_parameters =
        after->by_parameters - back * before->by_parameters -
        by_turn * TurnByParameters(calibration.covariance, at, turn);
    const Eigen::Matrix3d covariance =
        after->noise + back * before->noise * back.transpose() +
        by_turn * turn_noise * by_turn.transpose() +
        by_parameters * calibration.covariance.matrix * by_parameters.transpose();
    const Eigen::Vector3d up = after->truth.normalized();
    expected += (covariance.trace() - up.dot(covariance * up)) / after->truth.squaredNorm();
  }
  if (errors.empty()) return std::nullopt;
  EvaluatedTurns turns;
  turns.against = accelerometer ? Triad::kAccelerometer : Triad::kMagnetometer;
  turns.count = static_cast<int>(errors.size());
  turns.errors_rad = errors;
  turns.rms_rad = RootMeanSquareOf(errors);
  turns.median_rad = Median(errors);
  if (!nominal_errors.empty()) {
    turns.nominal_rms_rad = RootMeanSquareOf(nominal_errors);
    turns.nominal_median_rad = Median(nominal_errors);
  }
  turns.predicted_rms_rad = std::sqrt(expected / static_cast<double>(errors.size()));
  return turns;
}

}  // namespace truetriad
