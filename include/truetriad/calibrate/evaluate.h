// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The turns between the poses of an evaluation. The error of a turn is the angle between gravity
/// at the next rest as measured there and as predicted by the turn.
struct EvaluatedTurns {
  Triad against = Triad::kAccelerometer;  ///< The sensor whose vector is predicted.
  int count = 0;
  std::vector<double> errors_rad;  ///< Error of each turn.
  double rms_rad = 0.0;
  double median_rad = 0.0;
  /// RMS and median with an uncalibrated gyroscope (nominal gain of its unit, median at rest as
  /// bias) and the calibrated `against`; unset if the gyroscope's unit is counts.
  std::optional<double> nominal_rms_rad, nominal_median_rad;
  double predicted_rms_rad = 0.0;  ///< Expected from noise and parameter σ.
};

/// Prediction error of an existing calibration on poses that it has not seen.
struct EvaluationSummary {
  /// The calibration was made from these poses: poses that it left out are left out here, and the
  /// errors are no prediction errors.
  bool is_own = false;
  int poses = 0;
  int clamped_poses = 0;  ///< Outside the calibrated temperatures; evaluated at the nearest one.
  /// RMS of |C(y-b)| - reference, true unit; a gyroscope's reference is zero, since it rests.
  PerTriad<std::optional<double>> norm_rms;
  /// Whether errors are relative to their mean, since a reference is missing: the calibration
  /// states no field strength, or it is of a sweep that had no static calibration.
  PerTriad<bool> about_mean{};
  PerTriad<std::optional<double>> norm_rms_before;  ///< Uncalibrated norm_rms; unset for counts.
  PerTriad<std::optional<double>> predicted_rms;    ///< Expected from noise and parameter σ.
  /// RMS of all errors, whitened by noise and parameter covariance jointly: 1 if as predicted.
  /// Unlike norm_rms / predicted_rms, this ratio counts an error that all poses share, such as that
  /// of gravity, only once.
  PerTriad<std::optional<double>> error_ratio;
  /// Degrees of freedom of the noise estimate behind the prediction; zero if the noise was stated.
  PerTriad<double> noise_dof{};
  /// Standard deviation of the angle between field and gravity: zero in a uniform field without
  /// errors. `predicted_…`: expected from noise and parameter σ. `angle_ratio`: as `error_ratio`.
  /// Unset for fewer than two poses with both sensors.
  std::optional<double> angle_std_deg, predicted_angle_std_deg, angle_ratio;
  std::vector<double> angles_rad;  ///< Angle between field and gravity, pose by pose.
  /// Sensors that the calibration covers and of which the poses have no reading.
  std::vector<Triad> not_tested;
  std::optional<EvaluatedTurns> turns;  ///< Unset without moves or without a gyroscope.
  std::vector<PoseResidual> pose_residuals;
};

/// The result of an evaluation.
enum class PredictionVerdict {
  kNotEvaluated,  ///< No poses of the calibrated sensors.
  kNoTest,        ///< The calibration was made from this recording.
  kNoPrediction,  ///< There is no σ to compare with.
  kAsPredicted,   ///< At most kExpectedErrorRatio times the prediction, or more by chance.
  kWorse,
};
/// Over a few dozen poses, the ratio of two RMS scatters by some 20 %; 50 % is over twice that.
inline constexpr double kExpectedErrorRatio = 1.5;
PredictionVerdict VerdictOf(const EvaluationSummary& evaluation);
/// "not-evaluated", "no-test", "no-prediction", "as-predicted", "worse".
std::string_view PredictionVerdictName(PredictionVerdict verdict);
/// The largest ratio of an error to its prediction; unset if nothing was predicted.
std::optional<double> WorstErrorRatio(const EvaluationSummary& evaluation);

/// True units per count, where the recording states it.
using CountSizes = PerTriad<std::optional<double>>;

/// The units of readings may differ from those of the calibration if the sizes of both are known.
/// `is_own`: whether the calibration was made from `poses`.
Result<EvaluationSummary> Evaluate(const Calibration& calibration,
                                   const PoseSet& poses,
                                   bool is_own = false,
                                   const CountSizes& si_per_count = {});

}  // namespace truetriad
