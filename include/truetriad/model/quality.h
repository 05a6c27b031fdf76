// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// How evenly the directions of one triad's poses cover the sphere.
struct Coverage {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d eigenvalues = Eigen::Vector3d::Zero();  ///< Of mean(u u^T), ascending; sum: 1.
  /// Radius of the largest cap without a direction. A direction does not count for the opposite
  /// direction: only both together determine the bias.
  double largest_gap_deg = 180.0;
};

/// Computes the coverage from unit vectors u (body frame). The gap is searched on a grid of 4.5
/// degrees. Without directions: eigenvalues zero, gap 180.
Coverage DirectionCoverage(Triad triad, const std::vector<Eigen::Vector3d>& directions);

/// The allowed range of a value, in the unit of its quantity; an infinite end means no limit on
/// that side.
struct Limit {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::optional<double> target;  ///< The intended value; not judged.
  bool if_present = false;       ///< If a calibration lacks the quantity, the limit does not apply.

  /// A symmetric range: -most to `most`.
  static Limit Within(double most) { return {-most, most, std::nullopt, false}; }
  bool IsAboutZero() const { return lower == -upper && !target && !if_present; }
};

/// Which components a quantity has.
enum class LimitShape {
  kScalar,   ///< one
  kAxes,     ///< x, y, z
  kEntries,  ///< xy, xz, yx, yz, zx, zy
  kPairs,    ///< xy, xz, yz
};

/// A quantity for which limits can be set.
struct LimitQuantity {
  std::string_view name;  ///< "bias" (of a sensor) or "reference.dip_deg".
  LimitShape shape;
  std::string_view unit;  ///< "{true}": the sensor's true unit.
};

/// The parts of a limit's name: `accelerometer.bias`, `accelerometer.bias.x`, `reference.dip_deg`.
struct LimitName {
  std::optional<Triad> triad;  ///< Unset: a quantity of the reference.
  LimitQuantity quantity;
  std::string component;  ///< "x", "xy"; empty: every component.

  /// Whether the quantity is an RMS or a σ.
  bool IsNeverNegative() const;
  /// Whether the quantity is a slope over temperature.
  bool IsSlope() const;
  /// Whether the quantity depends on the magnetometer's common gain. This gain is a mere convention
  /// if the field strength is unknown.
  bool GoesWithField() const;
  /// "m/s^2", "rad", "1"; with the sensor's true unit inserted.
  std::string Unit() const;
};
/// Parses a name. Error (usage): the name is unknown; the message lists the known ones.
Result<LimitName> ParseLimitName(const std::string& name);

/// One direction in parameter space that the poses determine badly.
struct WeakDirection {
  std::string description;  ///< "magnetometer bias z and scale z cannot be told apart".
  std::string advice;       ///< "add poses with z up and down".
  double sigma = 0.0;       ///< σ along the direction, as a share of the signal (1 = 100 %).
};

/// One triad at one pose after the fit.
struct PoseResidual {
  int pose = 0;  ///< StaticPose::number.
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();  ///< C(y - b) - predicted, true unit.
  double norm_error = 0.0;                             ///< |C(y - b)| - reference, true unit.
  double norm_error_before =
      0.0;                  ///< norm_error of the uncalibrated nominal model; NaN if unknown.
  double normalized = 0.0;  ///< sqrt of the deletion χ² over its degrees of freedom.
  double weight = 1.0;      ///< Robust weight; 0 = rejected.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit vector of the truth, body.
};

/// Compares a turn that the operator stated with the turn that this calibration gives.
struct TurnCheck {
  std::string name;                                 ///< "turn 1 (x_rot)".
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< Body frame.
  double stated_rad = 0.0;
  double stated_sigma_rad = 0.0;
  double found_rad = 0.0;
  /// σ of found_rad from parameters and readings. If the turn was used in the fit, it helped to
  /// determine the parameters, and this σ is smaller than the σ of the difference from stated_rad.
  double found_sigma_rad = 0.0;
  bool used = false;  ///< False: the turn is held out, rejected or has a fault.
  std::string fault;  ///< Why the turn's readings are unusable, or empty.
};

/// The offset of a vector sensor's clock from the gyroscope's. It follows from how gravity or the
/// field turns in the body between the rests.
struct ClockOffset {
  Triad triad = Triad::kAccelerometer;
  double later_s = 0.0;  ///< The sensor's times minus the gyroscope's.
  double sigma_s = 0.0;  ///< From the scatter between the moves.
  int moves = 0;         ///< Number of moves that determine it.
  double p_value = 1.0;  ///< Probability of so large an offset if there were none.
};

/// The bias of a sensor in one of several sessions. Raw unit.
struct SessionBias {
  int session = 0;   ///< From 1 on.
  std::string file;  ///< The session's recording.
  Triad triad = Triad::kAccelerometer;
  int poses = 0;  ///< Number of poses in which the sensor was seen.
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Zero();
};

/// Scatter of a sensor's bias between sessions beyond the σ of the bias in each session. Raw unit.
struct BiasRepeatability {
  Triad triad = Triad::kAccelerometer;
  int sessions = 0;
  Eigen::Vector3d value_raw = Eigen::Vector3d::Zero();  ///< σ between sessions.
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Zero();  ///< σ of value_raw, given `sessions`.
  /// σ of the deviation of a future session's bias from the stated mean.
  Eigen::Vector3d next_session_raw = Eigen::Vector3d::Zero();
};

struct RejectedPose {
  int pose = 0;
  Triad triad = Triad::kAccelerometer;
  std::string reason;
};

/// Turns, each predicted by a calibration that did not use it. The error is the angle between two
/// directions at the next rest: gravity as the calibrated accelerometer measures it, and gravity as
/// predicted from the turn.
struct HeldOutTurns {
  std::vector<double> errors_rad;  ///< One per turn that could be predicted.
  double median_rad = 0.0;
  double in_sample_median_rad = 0.0;
  /// Median for an uncalibrated gyroscope: with the nominal gains of its unit and, as bias, its
  /// mean at rest; unset for counts.
  std::optional<double> nominal_median_rad;
};

/// Cross-validation over poses.
struct HeldOut {
  int folds = 0;
  /// Norm error of held-out poses, true unit; for the gyroscope the angle of HeldOutTurns, rad.
  PerTriad<std::optional<double>> rms;
  PerTriad<std::optional<double>> in_sample_rms;
  std::optional<HeldOutTurns> turns;
};

/// One of the components to which a limit applies, at the temperature at which it is worst.
struct LimitComponent {
  std::string component;  ///< "x", "xy"; empty for a scalar.
  double value = 0.0, sigma = 0.0;
  double outside = 0.0;  ///< Probability that the true value is outside the limit.
  bool pass = false;
};

/// A limit, and the worst of the components to which it applies, in the unit of the quantity.
struct LimitCheck {
  std::string name;       ///< "accelerometer.bias", "accelerometer.bias.x".
  std::string component;  ///< Component of `worst`: "x", "xy"; empty for a scalar or if in `name`.
  Limit limit;
  double worst = 0.0;  ///< The value closest to its limit or furthest beyond, guard band included.
  double sigma = 0.0;  ///< σ of `worst`.
  /// Probability that at least one component's true value is outside the limit. Each component is
  /// judged at its worst temperature, and components are assumed to be independent.
  double outside = 0.0;
  bool pass = false;
  double guard_band_k = 0.0;                    ///< value ± this many σ must be inside.
  std::vector<LimitComponent> components = {};  ///< All components; not in files.

  std::string FullName() const { return component.empty() ? name : name + "." + component; }
};

/// One of several nested models: the chosen one, or one that is a single step away from it.
struct ModelAlternative {
  std::string description;  ///< "gyroscope without g-sensitivity".
  bool chosen = false;
  int parameters = 0;          ///< Number of free parameters, all sensors together.
  double minus_2_log_l = 0.0;  ///< -2 log L without constants; all alternatives use the same noise.
  /// p-value of the likelihood-ratio test between this and the chosen model, if the smaller one is
  /// true. Unset for the chosen model.
  std::optional<double> p_value;
  double bic = 0.0;  ///< Bayesian information criterion.
  /// RMS of held-out poses and turns minus their prediction, in units of their noise; unset if
  /// there are too few to hold any out.
  std::optional<double> held_out;
};

/// The poses of one triad at about one temperature: the bias from these poses alone, and its
/// difference from the temperature terms, which are fitted to all poses.
struct TemperatureSetting {
  Triad triad = Triad::kAccelerometer;
  double degc = 0.0;  ///< Mean over these poses.
  int poses = 0;
  /// Bias from these poses alone, all other parameters fixed at the solution; raw unit.
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_sigma_raw = Eigen::Vector3d::Zero();    ///< From the noise of the poses.
  Eigen::Vector3d beyond_terms_raw = Eigen::Vector3d::Zero();  ///< bias_raw minus the terms' bias.
  /// RMS of |C(y-b)| - reference, true unit: before, with the calibration at the reference
  /// temperature; after, with that at each pose's temperature. A gyroscope's reference is zero,
  /// since it rests.
  double rms_before = 0.0, rms_after = 0.0;
};

/// One set of temperature terms that was tried for a sweep.
struct SweepStep {
  std::string terms;  ///< "tau, tau^2, T'".
  std::string what;   ///< "start", "+ tau T'", "- T'^2".
  double r2 = 0.0, adjusted_r2 = 0.0, bic = 0.0;
  double held_out = 0.0;  ///< RMS over held-out blocks of time, raw unit.
};

/// One step of a stepwise regression: the term that entered or left, and the regression after that.
struct RegressionStep {
  std::string what;  ///< "start", "+ tau^2", "- T'".
  int terms = 0;     ///< Number of terms, not counting each attitude's constant.
  double f = 0.0;    ///< Partial F of the term that entered or left; NaN at the start.
  double p_value = 1.0;
  double r2 = 0.0, adjusted_r2 = 0.0, bic = 0.0;
  double held_out = 0.0;  ///< RMS over held-out blocks of time, raw unit.
};

/// One term of a regression.
struct RegressionTerm {
  std::string name;  ///< "tau T'"; SweepRegression defines the letters.
  std::string unit;  ///< Unit of the coefficient: "m/s^2/(degC degC/s)".
  bool chosen = false;
  double coefficient = 0.0, sigma = 0.0;  ///< Coefficient and σ of a chosen term.
  double f = 0.0, p_value = 1.0;          ///< Partial F given the chosen terms; NaN: not tested.
  std::string why;                        ///< Why it was not tested, or empty.
};

/// A full second-order regression of an axis' window means; terms enter and leave by partial F:
///
///   y = constant of the attitude + sum of the products of one or two factors
///
/// r: the attitude's own reading; tau = T - T_ref; T'; A: ambient temperature less T_ref; A'. The
/// regression is reported, not applied.
struct SweepRegression {
  std::vector<std::string> factors;     ///< "r", "tau", "T'", "A", "A'": those asked for.
  int windows = 0;                      ///< Number of windows with all factors.
  double enter_p = 0.0, leave_p = 0.0;  ///< Levels for one term: total / number of candidates.
  double rms = 0.0;                     ///< RMS of the residuals, raw unit.
  std::vector<RegressionStep> steps;
  std::vector<RegressionTerm> terms;
};

/// The result of a temperature sweep for one axis. Raw unit.
struct SweepAxis {
  Triad triad = Triad::kAccelerometer;
  int axis = 0;
  double noise_sigma = 0.0;     ///< RMS σ of a window's mean from the noise inside the windows.
  double rms_before = 0.0;      ///< RMS of window means about the mean of their attitude.
  double rms_after = 0.0;       ///< RMS of window means about the fit.
  double held_out = 0.0;        ///< RMS of blocks of time, each predicted from the others.
  double held_out_cubic = 0.0;  ///< `held_out` of a plain cubic in temperature.
  int folds = 0;
  /// Mean residual while heating minus that while cooling, in the middle of the range that both
  /// cover: first for a polynomial in temperature alone, then for the fit; NaN if there is no
  /// common range.
  double branch_gap = 0.0, branch_gap_after = 0.0;
  double correlation = 0.0;  ///< Correlation of neighbouring windows' residuals.
  double element_lag_s = 0.0, element_lag_sigma_s = 0.0;
  double rate_lag_s = 0.0, rate_lag_sigma_s = 0.0;
  std::string chosen;                 ///< "tau, tau^2, tau^3, T'".
  std::vector<std::string> left_out;  ///< "T'^2: …reason…".
  std::vector<SweepStep> steps;       ///< Steps of the choice of terms.
  std::optional<SweepRegression> regression;
};

/// One window of a sweep, for charts. If there are many windows, only some are kept.
struct SweepWindow {
  Triad triad = Triad::kAccelerometer;
  double time_s = 0.0, degc = 0.0, rate_degcps = 0.0;
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();  ///< Window mean minus attitude mean.
  Eigen::Vector3d fit_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d fit_sigma_raw = Eigen::Vector3d::Zero();
};

/// The test of a term that the model lacks, and how much the term could shift parameters without
/// being detected.
struct LeftOutTest {
  Triad triad = Triad::kAccelerometer;
  std::string term;       ///< "quadratic", "bias drift".
  double p_value = 1.0;   ///< p-value of the term's test beside the terms that are shown.
  bool is_shown = false;  ///< The term is corrected, or σ include it.
  /// Shift of the most affected parameter, in that parameter's σ, if the term changes by one σ of
  /// the term; unset if the readings do not determine the whole term.
  std::optional<double> kappa;
};

/// The part of Quality that only rests have.
struct RestQuality {
  std::optional<HeldOut> held_out;
  std::vector<ModelAlternative> model_choice;  ///< Chosen model first; empty: none chosen.
  /// The steps towards the choice: the largest model, then each term that was removed or restored,
  /// with the model after that step and the p-value of the step.
  std::vector<ModelAlternative> model_steps;
  std::vector<RejectedPose> rejected_poses;
  std::vector<TurnCheck> turns;            ///< The turns that were stated.
  std::vector<ClockOffset> clock_offsets;  ///< The offsets that moves between rests determine.
  /// For sensors with one bias per session; their mean is the sensor's bias.
  std::vector<SessionBias> sessions;
  std::vector<BiasRepeatability> repeatability;
  std::vector<PoseResidual> pose_residuals;
  std::vector<TemperatureSetting> temperature_settings;  ///< For triads with temperature terms.
};

/// The part of Quality that only a temperature sweep has.
struct SweepQuality {
  std::vector<SweepAxis> axes;
  std::vector<SweepWindow> windows;
};

/// How well the solution explains the data, and which data support it. A calibration from motion
/// has neither `rests` nor `sweep`.
struct Quality {
  int poses = 0;                                 ///< Rests, attitudes of a motion, or windows.
  PerTriad<std::optional<double>> residual_rms;  ///< RMS of |C(y-b)| - reference, true unit.
  PerTriad<std::optional<double>> residual_rms_before;  ///< RMS of the uncalibrated sensor.
  double reduced_chi2 = 0.0;                            ///< With the excess noise.
  double reduced_chi2_before = 0.0;                     ///< With the noise inside the rests alone.
  double dof = 0.0;                                     ///< Residuals minus parameters.
  double effective_dof = 0.0;  ///< Satterthwaite ν for intervals and joint tests.
  std::vector<WeakDirection> weak_directions;
  std::vector<LeftOutTest> left_out_tests;
  std::vector<Coverage> coverage;
  std::vector<LimitCheck> limits;
  RestQuality rests;   ///< Empty unless Mode::kPoses.
  SweepQuality sweep;  ///< Empty unless Mode::kSweep.
};

}  // namespace truetriad
