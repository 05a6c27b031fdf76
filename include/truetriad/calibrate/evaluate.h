// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The turns between the poses of an evaluation. The error of a turn is the angle between gravity
/// as measured at the next rest and gravity as predicted from the turn.
struct EvaluatedTurns {
  Triad against = Triad::kAccelerometer;  ///< The sensor whose vector is predicted.
  int count = 0;
  std::vector<double> errors_rad;  ///< Error of each turn.
  double rms_rad = 0.0;
  double median_rad = 0.0;
  /// RMS and median of the errors with an uncalibrated gyroscope (nominal gain of its unit, median
  /// at rest as bias) and the calibrated sensor `against`; unset if the gyroscope's unit is counts.
  std::optional<double> nominal_rms_rad, nominal_median_rad;
  double predicted_rms_rad = 0.0;  ///< Expected from noise and parameter σ.
};

/// Prediction error of an existing calibration on poses that it has not seen.
struct EvaluationSummary {
  /// Whether the calibration was made from these poses. If so, the poses that it left out are left
  /// out here as well, and the errors are no prediction errors.
  bool is_own = false;
  int poses = 0;
  int clamped_poses = 0;  ///< Poses outside the calibrated temperatures; evaluated at the end.
  /// RMS of |C(y-b)| - reference, true unit; a gyroscope's reference is zero, since it rests.
  PerTriad<std::optional<double>> norm_rms;
  /// Whether errors are relative to their mean, since a reference is missing: the calibration
  /// states no field strength, or it is of a sweep that had no static calibration.
  PerTriad<bool> about_mean{};
  PerTriad<std::optional<double>> norm_rms_before;  ///< Uncalibrated norm_rms; unset for counts.
  PerTriad<std::optional<double>> predicted_rms;    ///< Expected from noise and parameter σ.
  /// RMS of all errors, whitened by the covariance of noise and parameters together: 1 if the
  /// errors are as predicted. Unlike norm_rms / predicted_rms, this ratio counts an error that all
  /// poses share, such as that of gravity, only once.
  PerTriad<std::optional<double>> error_ratio;
  /// Degrees of freedom of the noise estimate behind the prediction; zero if the noise was stated.
  PerTriad<double> noise_dof{};
  /// Standard deviation of the angle between field and gravity: zero in a uniform field without
  /// errors. `predicted_…`: expected from noise and parameter σ. `angle_ratio`: as `error_ratio`.
  /// Unset for fewer than two poses with both sensors.
  std::optional<double> angle_std_deg, predicted_angle_std_deg, angle_ratio;
  std::vector<double> angles_rad;  ///< Angle between field and gravity, pose by pose.
  /// Sensors that the calibration covers, but of which the poses have no reading.
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

/// Evaluates a calibration on `poses`. The units of readings may differ from those of the
/// calibration if both sizes are known. `is_own`: whether the calibration was made from `poses`.
Result<EvaluationSummary> Evaluate(const Calibration& calibration,
                                   const PoseSet& poses,
                                   bool is_own = false,
                                   const CountSizes& si_per_count = {});

/// Which of two calibrations has the smaller errors.
enum class Better { kNeither, kA, kB, kMixed };
/// "neither", "a", "b", "mixed".
std::string_view BetterName(Better better);

/// One kind of error of two calibrations on the same poses; `a` and `b` are the two RMS.
struct ErrorOfTwo {
  /// "accelerometer": length of the reading minus gravity; "accelerometer-spread": that length
  /// minus its mean; "magnetometer" and "magnetometer-spread": the same with the field instead of
  /// gravity; "angle": angle between field and gravity minus its mean; "gyroscope": rate at rest;
  /// "turn": direction after each turn.
  std::string_view name;
  std::string_view unit;  ///< "mm/s^2", "uT", "deg", "deg/s".
  double a = 0.0, b = 0.0;
  int count = 0;  ///< Poses, or turns.
  /// kNeither unless the errors differ by over 10 % and by more than chance; "accelerometer" must
  /// also differ by more than 2 σ of gravity. "magnetometer" never decides, since fields differ
  /// from place to place.
  Better better = Better::kNeither;

  /// The larger error as a multiple of the smaller.
  double times() const { return a < b ? b / a : a / b; }
};

/// Errors of two calibrations of one unit on the same recording. They are compared with each other,
/// not with predicted errors, since imported calibrations have no σ.
struct SideBySide {
  EvaluationSummary a, b;
  std::vector<ErrorOfTwo> errors;
  /// The references with which lengths are compared. An imported calibration only assumes them, so
  /// those of a calibration by this program take precedence. If no field is set, the mean length
  /// under each calibration is used.
  double gravity_mps2 = kStandardGravityMps2;
  std::optional<double> field_ut;
};
Better BetterOf(const SideBySide& both);

/// `is_own`: whether a and b were made from `poses`. If one of the two left out a pose, it is left
/// out for both. Errors: as Evaluate.
Result<SideBySide> EvaluateSideBySide(const Calibration& a,
                                      const Calibration& b,
                                      const PoseSet& poses,
                                      const std::array<bool, 2>& is_own = {},
                                      const CountSizes& si_per_count = {});

/// One parameter of two calibrations of one unit, both in the same body frame.
struct ComparisonEntry {
  std::string parameter;
  double a = 0.0, b = 0.0;
  double difference = 0.0;
  double sigma = 0.0;  ///< σ of the difference if the two are independent.
};
struct Comparison {
  std::vector<ComparisonEntry> entries;
  double chi2 = 0.0;
  int dof = 0;
  double p_value = 1.0;
  double largest_in_sigmas = 0.0;
  /// Parameters that are not compared, in words: those that one of the two lacks, holds fixed or
  /// states without a σ.
  std::vector<std::string> not_compared;
  /// The field strength was only a convention in at least one of the two calibrations. The
  /// comparison therefore leaves out the common scale of the magnetometer.
  bool field_scale_taken_out = false;
  /// The body frames are unrelated (one is the accelerometer's, the other the magnetometer's). Only
  /// values that no rotation changes were compared, such as biases and C^T C ("gram").
  bool frames_differ = false;
};

/// Whether two calibrations agree.
enum class Agreement {
  kNotCompared,  ///< They have no common parameter with a σ.
  kAgree,        ///< p of all differences together is at least kAgreementProbability.
  kDiffer,
};
/// If a unit is unchanged, one in a hundred pairs of calibrations counts as kDiffer by chance.
inline constexpr double kAgreementProbability = 0.01;
Agreement AgreementOf(const Comparison& comparison);
std::string_view AgreementName(Agreement agreement);  ///< "not-compared", "agree", "differ".

/// Whether the two calibrations are more alike than calibrations from two recordings could be, even
/// if their σ were three times too large. They were then made from the same readings.
bool IsTooAlike(const Comparison& comparison);

/// The entry that differs by the most σ; null if none has a σ.
const ComparisonEntry* LargestOf(const Comparison& comparison);

Result<Comparison> Compare(const Calibration& a, const Calibration& b);

/// How much a unit's parameters change from one power-up or day to the next, in addition to noise.
struct Repeatability {
  PerTriad<double> bias{{0.0, 0.0, 0.0}};   ///< σ of each axis, true unit.
  PerTriad<double> scale{{0.0, 0.0, 0.0}};  ///< Relative σ of each gain.
};

/// Adds the repeatability to the calibration's covariance, so that it can be compared with a
/// calibration of another day.
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration);

/// Restates the calibration for exactly this gravity. Two calibrations from one place share the
/// error of gravity, which is then no uncertainty of their difference. Unchanged if gravity was
/// exact.
Calibration AtGravity(double gravity_mps2, Calibration calibration);

}  // namespace truetriad
