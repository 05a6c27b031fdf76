// SPDX-License-Identifier: Apache-2.0
#include "calibrate/evaluate_turns.h"

#include <cmath>

#include "math/distributions.h"
#include "problem/moves.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/math/rotation.h"
#include "verdict/turn_errors.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

// d rotation / d the listed parameters of the calibration, as GyroIncrement has it.
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

// The gyroscope at the mean temperature of the poses at both ends.
ModelAtPose ModelBetween(const TriadCalibration& sensor,
                         const StaticPose& first,
                         const StaticPose& second) {
  return ModelAtTemperatureOf(
      sensor,
      0.5 * (first.temperature_degc.value_or(0.0) + second.temperature_degc.value_or(0.0)),
      0.5 * (first.temperature_rate_degcps + second.temperature_rate_degcps));
}

}  // namespace

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
  const StreamSummary* stream = poses.Find(kGyroscope);
  if (!gyroscope || stream == nullptr) return std::nullopt;
  const std::optional<TriadModel<double>> nominal = NominalGyroscope(poses);
  const Eigen::Vector3d sigma_raw = ReadingSigma(*stream);
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

    // after - R^T before, R the turn: R^T turns with -d, so R^T before changes by its cross product
    // with d.
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
