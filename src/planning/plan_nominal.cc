// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "base/sensor_line.h"
#include "noise/deletion.h"
#include "planning/plan_problem.h"
#include "problem/lay_out.h"
#include "problem/moves.h"
#include "truetriad/base/triad.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/math/rotation.h"

// The unit and the noise that are assumed as long as the planned poses are not recorded.

namespace truetriad {
namespace {

// Assumed rate of the gyroscope's readings, Hz. Any rate gives the same plan, since only the noise
// density matters.
constexpr double kPlannedRateHz = 100.0;
// Strength of the field as at middle latitudes.
constexpr double kUsualFieldUt = 50.0;
constexpr double kUsualDipRad = std::numbers::pi / 3.0;  // Dip at middle latitudes.

}  // namespace

// Chooses the nominal unit, at which the graph is linearised, and the noise of the graph's rows:
// both are taken from a calibration of the measured poses if these suffice for one, otherwise from
// the experiment.
Status PlanProblem::ChooseNominal() {
  const bool free_attitudes = calibrate().attitudes.kind == AttitudeKind::kNone;
  if (!measured_.poses.empty()) {
    CalibrateOptions solved = calibrate();
    solved.gauge = free_attitudes ? Gauge::kAccelX : Gauge::kFixture;
    solved.limits = {};
    solved.cross_validation_folds = 0;
    solved.initialise.only = false;
    TRUETRIAD_ASSIGN_OR_RETURN(auto summary, Calibrate(measured_, solved));
    if (summary.calibration.IsUsable()) calibrated_ = std::move(summary.calibration);
    messages_.push_back(calibrated_
                            ? "the prediction is linearised at the calibration of the recording"
                            : "the recording is not enough for a calibration; the prediction is "
                              "linearised at the nominal values");
  }
  for (const Triad triad : kTriads) {
    TriadOptions& sensor = calibrate().triads[triad];
    if (!sensor.enabled) continue;
    const Unit& unit = measured_.Find(triad)->unit;
    if (calibrated_) {
      nominal_.models[triad] = calibrated_->sensors[triad]->model;
    } else if (options_.nominal[triad]) {
      nominal_.models[triad] = options_.nominal[triad];
    } else if (unit.is_counts && !sensor.fixed_sensitivity) {
      return Error(ErrorCode::kCountsOfUnknownSize,
                   std::string(TriadName(triad)) +
                       ": readings are in counts of unknown size; state roughly how many "
                       "counts one true unit is, as in `plan: { nominal: { " +
                       std::string(TriadName(triad)) + ": { sensitivity: 400 } } }`");
    } else {
      const double sign = triad == LeadingTriad(calibrate()) ? LeadingAxisSign(calibrate()) : 1.0;
      nominal_.models[triad] = {
          sign / unit.truth_per_raw * sensor.mounting.value_or(Eigen::Matrix3d::Identity()),
          Eigen::Vector3d::Zero()};
    }
    if (sensor.fixed_sensitivity) nominal_.models[triad]->sensitivity = *sensor.fixed_sensitivity;
    if (sensor.model == MatrixModel::kBias && !sensor.fixed_sensitivity) {
      sensor.fixed_sensitivity = nominal_.models[triad]->sensitivity;
    }
  }
  const Triad leading = LeadingTriad(calibrate());
  if (!calibrated_ && free_attitudes && !calibrate().triads[leading].fixed_sensitivity) {
    const Eigen::Matrix3d Q =
        LeadingGaugeRotation(calibrate(), Gauge::kAccelX, nominal_.models[leading]->sensitivity);
    for (auto& model : nominal_.models) {
      if (model) model->sensitivity = model->sensitivity * Q;
    }
  }
  ChooseReference();
  return ChooseNoise();
}

void PlanProblem::ChooseReference() {
  const ReferenceOptions& reference = calibrate().reference;
  const double usual_dip_rad = reference.northern_hemisphere ? kUsualDipRad : -kUsualDipRad;
  nominal_.reference << *reference.gravity_mps2.value,
      reference.field_ut.value.value_or(options_.nominal_field_ut.value_or(kUsualFieldUt)),
      reference.dip_rad.value.value_or(options_.nominal_dip_rad.value_or(usual_dip_rad)), 0.0;
  double &field_ut = nominal_.reference[kField], &dip_rad = nominal_.reference[kDip];
  if (calibrated_) {
    field_ut = calibrated_->reference.field_ut.value_or(field_ut);
    dip_rad = calibrated_->reference.dip_rad.value_or(dip_rad);
  } else if (nominal_.models[Triad::kMagnetometer]) {
    if (!reference.field_ut.known() && !options_.nominal_field_ut) {
      messages_.push_back("field strength unknown: the plan assumes " +
                          Format("%.4g uT (plan.nominal.strength_ut)", field_ut));
    }
    if (!reference.dip_rad.known() && !options_.nominal_dip_rad) {
      messages_.push_back("dip unknown: the plan assumes " +
                          Format("%.3g deg (plan.nominal.dip_deg)", dip_rad * kDegPerRad));
    }
  }
  if (calibrate().attitudes.kind != AttitudeKind::kGiven) return;
  const std::optional<TriadModel<double>>& magnetometer = nominal_.models[Triad::kMagnetometer];
  Eigen::Vector3d field = Eigen::Vector3d::Zero();
  for (const StaticPose& pose : measured_.poses) {
    const auto& reading = pose.triads[Triad::kMagnetometer];
    if (!reading || !magnetometer) continue;
    field += pose.attitude->world_from_body * magnetometer->TruthFromRaw(reading->mean_raw);
  }
  if (!field.isZero(0.0)) nominal_.reference[kHeading] = std::atan2(field.y(), field.x());
}

Status PlanProblem::ChooseNoise() {
  for (const Triad triad : kTriads) {
    const TriadOptions& sensor = calibrate().triads[triad];
    if (!sensor.enabled) continue;
    rest_covariance_[triad].setZero();
    source_[triad] = NoiseSource::kStatic;
    if (sensor.noise_sigma_raw) {
      source_[triad] = sensor.noise_source;
    } else if (sensor.allan) {
      source_[triad] = NoiseSource::kAllan;
      if (!(options_.rest_s > 0.0)) {
        return Error(ErrorCode::kMissingKey,
                     std::string(TriadName(triad)) +
                         ": its noise is a density, so the length of a rest is needed; state "
                         "it, as in `plan: { rest_s: 5 }`");
      }
    } else if (calibrated_) {
      source_[triad] = calibrated_->sensors[triad]->noise.source;
      rest_covariance_[triad] = calibrated_->sensors[triad]->noise.sigma.cwiseAbs2().asDiagonal();
    } else {
      int count = 0;
      for (const StaticPose& pose : measured_.poses) {
        if (!pose.triads[triad] || !pose.triads[triad]->has_covariance) continue;
        rest_covariance_[triad] += pose.triads[triad]->mean_covariance_raw;
        ++count;
      }
      if (count == 0) {
        return Error(ErrorCode::kMissingKey,
                     std::string(TriadName(triad)) + ": its noise is unknown; state " +
                         SensorLine(triad, "noise: { sigma: [x, y, z] }") +
                         " (of a pose's mean, raw unit) or " +
                         SensorLine(triad, "noise: { allan: FILE }") +
                         " with `plan: { rest_s: … }`, or give a recording with rests");
      }
      rest_covariance_[triad] /= count;
    }
    if (sensor.excess == ExcessNoise::kGiven) {
      excess_[triad] = sensor.excess_sigma * sensor.excess_sigma;
    } else if (sensor.excess == ExcessNoise::kEstimate) {
      const double sigma = calibrated_ ? calibrated_->sensors[triad]->noise.excess_sigma : 0.0;
      excess_[triad] = sigma * sigma;
      if (!calibrated_) {
        messages_.push_back(std::string(TriadName(triad)) +
                            ": pose-to-pose noise is unknown and not included in the prediction; "
                            "state " +
                            SensorLine(triad, "noise: { excess: { sigma: … } }") +
                            " if you know it");
      }
    }
  }
  if (calibrate().triads[Triad::kGyroscope].enabled) {
    TRUETRIAD_RETURN_IF_ERROR(ChooseTurns());
  }
  if (calibrated_) {
    for (const PoseResidual& residual : calibrated_->quality.rests.pose_residuals) {
      weights_[{residual.pose, residual.triad}] = std::max(residual.weight, kRejectedWeight);
    }
  }
  return {};
}

// The approximate σ of a pose's attitude about each axis, from the noise of its readings.
double PlanProblem::AttitudeSigma() const {
  double variance = options_.attitude_sigma_rad.squaredNorm() / 3.0;
  if (calibrate().attitudes.kind == AttitudeKind::kGiven) return std::sqrt(variance);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!nominal_.models[triad]) continue;
    const Eigen::Matrix3d correction = nominal_.models[triad]->Correction();
    const TriadOptions& sensor = calibrate().triads[triad];
    Eigen::Matrix3d covariance = rest_covariance_[triad];
    if (sensor.noise_sigma_raw) covariance = sensor.noise_sigma_raw->cwiseAbs2().asDiagonal();
    const double share =
        ((correction * covariance * correction.transpose()).trace() / 3.0 + excess_[triad]) /
        WorldVector(triad, nominal_.reference).squaredNorm();
    variance = std::max(variance, share);
  }
  return std::sqrt(variance);
}

// Sets the noise of a turn: the noise of the gyroscope's readings at rest, integrated over the
// turn.
Status PlanProblem::ChooseTurns() {
  const TriadOptions& sensor = calibrate().triads[Triad::kGyroscope];
  turns_.gyroscope = *nominal_.models[Triad::kGyroscope];
  turns_.is_bent = sensor.HasAxisTerm(Wanted::kYes);
  turns_.attitude_sigma_rad = AttitudeSigma();
  turns_.has_heading = has_heading_;
  turns_.duration_s = options_.turn_s;
  turns_.sigma_rad = options_.turn_sigma_rad;
  if (calibrated_ && turns_.sigma_rad == 0.0) {
    turns_.sigma_rad = calibrated_->sensors[Triad::kGyroscope]->noise.turn_excess_sigma_rad;
  }
  excess_[NoiseComponent::kTurn] = turns_.sigma_rad * turns_.sigma_rad;
  const auto stream =
      std::find_if(measured_.streams.begin(), measured_.streams.end(), [](const auto& candidate) {
        return candidate.triad == Triad::kGyroscope;
      });
  turns_.rate_hz = stream->rate_hz > 0.0 ? stream->rate_hz : kPlannedRateHz;
  if (!stream->noise_sigma_raw.isZero(0.0)) {
    turns_.reading_sigma_raw = ReadingSigma(*stream);
    return {};
  }
  Eigen::Vector3d density_raw = Eigen::Vector3d::Zero();
  if (sensor.allan) {
    density_raw = sensor.allan->white_density_raw;
  } else if (sensor.noise_sigma_raw && options_.rest_s > 0.0) {
    density_raw = *sensor.noise_sigma_raw * std::sqrt(options_.rest_s);
  } else {
    return Error(
        ErrorCode::kMissingKey,
        "gyroscope: its stated noise is that of a rest's mean, so the σ of a turn depends on the "
        "length of this rest; state it in s, as in `plan: { rest_s: 5 }`");
  }
  stream->rate_hz = kPlannedRateHz;
  stream->noise_sigma_raw = density_raw * std::sqrt(kPlannedRateHz);
  turns_.reading_sigma_raw = stream->noise_sigma_raw;
  return {};
}

}  // namespace truetriad
