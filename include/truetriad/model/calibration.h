// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/input_file.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/model/coverage.h"
#include "truetriad/model/gauge.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// How a calibration ended. Converged is not the same as observable, observable is not the same
/// as within limits.
enum class Outcome {
  kNotCalled,      ///< Nothing was run.
  kConverged,      ///< Usable.
  kNotObservable,  ///< The poses do not determine every wanted parameter.
  kNotConverged,   ///< The optimiser gave up, or the fit does not explain the data.
  kNotEnough,      ///< No rests, or fewer poses than parameters.
};
std::string_view OutcomeName(Outcome outcome);  ///< "converged", "not_observable", …
std::optional<Outcome> OutcomeFromName(std::string_view name);

/// Where the noise that weighted a triad came from.
enum class NoiseSource { kStatic, kAllan, kDatasheet, kConfig, kResidual };
std::string_view NoiseSourceName(NoiseSource source);
std::optional<NoiseSource> NoiseSourceFromName(std::string_view name);

/// Noise of one triad, as used for the weights.
struct TriadNoise {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< RMS σ of a pose mean inside its rest, raw.
  NoiseSource source = NoiseSource::kStatic;
  double excess_sigma = 0.0;  ///< Pose-to-pose excess σ, isotropic, true unit.
  double excess_dof = 0.0;    ///< Degrees of freedom behind excess_sigma.
  /// Gyroscope: σ of a turn about each axis beyond what the noise of its readings makes, rad.
  double turn_excess_sigma_rad = 0.0;
};

/// Where the bias of one axis changes its course: from `degc` up it has
/// slope (T - degc) + curve (T - degc)^2 more, less what that is at the reference.
struct ThermalKnot {
  int axis = 0;
  double degc = 0.0;
  double slope = 0.0, curve = 0.0;  ///< raw / degC, raw / degC^2; slope 0: no kink.
};

/// Temperature terms of one triad, in tau = T - reference. docs/method.md, "Temperature".
struct ThermalTerms {
  double reference_degc = 25.0;
  Eigen::Vector2d range_degc = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector3d> bias;         ///< For tau^1, tau^2, …; raw / degC^i.
  std::vector<Eigen::Matrix3d> sensitivity;  ///< For tau^1, ….
  std::optional<Eigen::Vector3d> rate_linear, rate_quadratic, rate_cross;
  /// First-order lags of each axis, s: of its temperature behind the thermometer, and of the rate
  /// that it follows behind the rate of that temperature. model/thermal.h. Unset: none.
  std::optional<Eigen::Vector3d> element_lag_s, rate_lag_s;
  /// Half-width over which the temperature was smoothed to find its rate, s; 0: not stated.
  double smoothing_s = 0.0;
  std::vector<ThermalKnot> knots = {};
  /// Lowest and highest rate that a sweep passed, degC/s; unset: not stated.
  std::optional<Eigen::Vector2d> rate_range_degcps = {};
};

/// The calibration of one triad.
struct TriadCalibration {
  std::string input_unit;
  std::string output_unit;
  TriadModel<double> model;  ///< Bias (raw), sensitivity (raw per true unit), higher terms.
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sensitivity_sigma = Eigen::Matrix3d::Zero();
  /// Set where the model has the term.
  std::optional<Eigen::Vector3d> quadratic_sigma, asymmetry_sigma;
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<ThermalTerms> thermal;
  std::optional<double> si_per_count;  ///< True units per count, when the recording stated it.
  TriadNoise noise;

  /// Gains: the diagonal of the sensitivity.
  Eigen::Vector3d Scale() const { return model.sensitivity.diagonal(); }
  /// K^-1 S - I with K = diag S, rad.
  Eigen::Matrix3d MisalignmentRad() const;
};

/// Covariance of every entry listed, in the stated gauge; singular where entries are fixed or tied.
struct NamedCovariance {
  std::vector<std::string>
      parameters;  ///< "accelerometer.bias.x", "magnetometer.sensitivity.zz", …
  Eigen::MatrixXd matrix;
};

/// The quantities that the world provides.
struct ReferenceValues {
  double gravity_mps2 = kStandardGravityMps2;
  std::optional<double> gravity_sigma_mps2;  ///< Prior σ, when not exact.
  std::optional<double> field_ut;  ///< Strength used or estimated; only with a magnetometer.
  std::optional<double> dip_rad;
  bool field_estimated = false;  ///< Strength or dip was estimated.
  /// The strength is nominal: the magnetometer's common scale is not observable.
  bool field_nominal = false;
  /// Frame of the attitudes from outside <- world, where the fixture's rotation was estimated: x of
  /// the world is magnetic north with a magnetometer, else along the fixture's x. qw, qx, qy, qz.
  std::optional<Eigen::Vector4d> fixture_from_world;
  double temperature_degc = 25.0;
  /// What the thermometer said at the poses: lowest, mean, highest; unset: there was none.
  std::optional<Eigen::Vector3d> recorded_degc = {};
};

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
      0.0;                  ///< The same with the uncalibrated nominal model; NaN if unknown.
  double normalized = 0.0;  ///< sqrt of the deletion χ² over its degrees of freedom.
  double weight = 1.0;      ///< Robust weight; 0 = rejected.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit truth direction in body.
};

/// A turn that the operator stated, as this calibration sees it.
struct TurnCheck {
  std::string name;                                 ///< "turn 1 (x_rot)".
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< Body frame.
  double stated_rad = 0.0;
  double stated_sigma_rad = 0.0;
  double found_rad = 0.0;
  /// Of found_rad: parameters and readings; of a turn that was used, smaller than its difference.
  double found_sigma_rad = 0.0;
  bool used = false;  ///< Else held out, rejected, or with a fault.
  std::string fault;  ///< Why its readings tell nothing, or empty.
};

/// The clock of a vector sensor against the gyroscope's, from how fields turned in the body between
/// the rests.
struct ClockOffset {
  Triad triad = Triad::kAccelerometer;
  double later_s = 0.0;  ///< By how much its times are later than those of the gyroscope.
  double sigma_s = 0.0;  ///< From how the moves scatter.
  int moves = 0;         ///< That show it.
  double p_value = 1.0;  ///< Of so large an offset, were there none.
};

struct RejectedPose {
  int pose = 0;
  Triad triad = Triad::kAccelerometer;
  std::string reason;
};

/// Turns, each predicted by a calibration that had not seen it: the angle between gravity at the
/// next rest as the calibrated accelerometer shows it and as the turn predicts it.
struct HeldOutTurns {
  std::vector<double> errors_rad;  ///< Turn by turn; those that do not count are left out.
  double median_rad = 0.0;
  double in_sample_median_rad = 0.0;
  /// With the gains that the gyroscope's unit says and its mean at rest as bias; unset for counts.
  std::optional<double> nominal_median_rad;
};

/// Cross-validation over poses.
struct HeldOut {
  int folds = 0;
  /// Norm error of held-out poses, true unit; of a gyroscope the angle of HeldOutTurns, rad.
  PerTriad<std::optional<double>> rms;
  PerTriad<std::optional<double>> in_sample_rms;
  std::optional<HeldOutTurns> turns;
};

struct LimitCheck {
  std::string name;  ///< "accelerometer.bias".
  double limit = 0.0;
  double worst = 0.0;  ///< Largest |value| judged.
  double sigma = 0.0;  ///< Its σ.
  bool pass = false;
};

/// The chosen model of a choice among nested ones, or one that differs from it by one step.
struct ModelAlternative {
  std::string description;  ///< "gyroscope without g-sensitivity".
  bool chosen = false;
  int parameters = 0;  ///< Free ones, all sensors together.
  double minus_2_log_l =
      0.0;  ///< -2 log L, all alternatives with the same noise; without constants.
  /// Probability of so large a likelihood ratio between this and the chosen model, were the smaller
  /// of the two true. Unset for the chosen one.
  std::optional<double> p_value;
  double bic = 0.0;  ///< Bayesian information criterion.
  /// RMS of what held-out poses and turns say against the prediction, in units of their noise;
  /// unset where there are too few to hold some out.
  std::optional<double> held_out;
};

/// Poses of one triad at about one temperature, and what they say by themselves against what the
/// temperature terms of all say there.
struct TemperatureSetting {
  Triad triad = Triad::kAccelerometer;
  double degc = 0.0;  ///< Mean over its poses.
  int poses = 0;
  /// From these poses alone, everything else held at the solution; raw unit.
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_sigma_raw = Eigen::Vector3d::Zero();    ///< By the poses' noise, one σ.
  Eigen::Vector3d beyond_terms_raw = Eigen::Vector3d::Zero();  ///< bias_raw less the terms.
  /// RMS of |C(y-b)| - reference, true unit: with the calibration at the reference temperature, and
  /// with that at each pose's own. Of a gyroscope the reference is zero: it rests.
  double rms_before = 0.0, rms_after = 0.0;
};

/// One set of temperature terms that was tried in a sweep.
struct SweepStep {
  std::string terms;  ///< "tau, tau^2, T'".
  std::string what;   ///< "start", "+ tau T'", "- T'^2".
  double r2 = 0.0, adjusted_r2 = 0.0, bic = 0.0;
  double held_out = 0.0;  ///< RMS over held-out blocks of time, raw unit.
};

/// One step of a stepwise regression: what entered or left, and the regression with it.
struct RegressionStep {
  std::string what;  ///< "start", "+ tau^2", "- T'".
  int terms = 0;     ///< In it, the constants of attitudes aside.
  double f = 0.0;    ///< Partial F of what entered or left; NaN at the start.
  double p_value = 1.0;
  double r2 = 0.0, adjusted_r2 = 0.0, bic = 0.0;
  double held_out = 0.0;  ///< RMS over held-out blocks of time, raw unit.
};

/// One term of a regression.
struct RegressionTerm {
  std::string name;  ///< "tau T'"; SweepRegression says what the letters mean.
  std::string unit;  ///< Of the coefficient: "m/s^2/(degC degC/s)".
  bool chosen = false;
  double coefficient = 0.0, sigma = 0.0;  ///< Of a chosen one.
  double f = 0.0, p_value = 1.0;          ///< Partial, beside the chosen ones; NaN: not tested.
  std::string why;                        ///< Of one that was not tested.
};

/// A full second-order regression of an axis' window means, terms entered and removed by partial F:
///
///   y = constant of the attitude + sum of the products of one or two factors
///
/// r: the attitude's own reading; tau = T - T_ref; T'; A: ambient temperature less T_ref; A'. It
/// is reported, not applied.
struct SweepRegression {
  std::vector<std::string> factors;     ///< "r", "tau", "T'", "A", "A'": those that were wanted.
  int windows = 0;                      ///< That have all of them.
  double enter_p = 0.0, leave_p = 0.0;  ///< Level of a term: that of all, shared by the candidates.
  double rms = 0.0;                     ///< That it leaves, raw unit.
  std::vector<RegressionStep> steps;
  std::vector<RegressionTerm> terms;
};

/// What a temperature sweep says of one axis. Raw unit.
struct SweepAxis {
  Triad triad = Triad::kAccelerometer;
  int axis = 0;
  double noise_sigma = 0.0;     ///< RMS σ of a window's mean from the noise inside the windows.
  double rms_before = 0.0;      ///< Of the window means about the mean of their attitude.
  double rms_after = 0.0;       ///< About the fit.
  double held_out = 0.0;        ///< Each block of time predicted by the others; lags found anew.
  double held_out_cubic = 0.0;  ///< The same of a plain cubic in temperature.
  int folds = 0;
  /// Heating minus cooling at the middle of the temperatures that both passed, about a polynomial
  /// in temperature alone, and about the fit; NaN where one of the two is missing.
  double branch_gap = 0.0, branch_gap_after = 0.0;
  double correlation = 0.0;  ///< Of neighbouring windows' residuals.
  double element_lag_s = 0.0, element_lag_sigma_s = 0.0;
  double rate_lag_s = 0.0, rate_lag_sigma_s = 0.0;
  std::string chosen;                 ///< "tau, tau^2, tau^3, T'".
  std::vector<std::string> left_out;  ///< "T'^2: …why…".
  std::vector<SweepStep> steps;       ///< Where terms were chosen.
  std::optional<SweepRegression> regression;
};

/// One window of a sweep, for people to look at; many windows are thinned.
struct SweepWindow {
  Triad triad = Triad::kAccelerometer;
  double time_s = 0.0, degc = 0.0, rate_degcps = 0.0;
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();  ///< What the attitude leaves of the mean.
  Eigen::Vector3d fit_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d fit_sigma_raw = Eigen::Vector3d::Zero();
};

struct Quality {
  int poses = 0;
  PerTriad<std::optional<double>> residual_rms;         ///< RMS of |C(y-b)| - reference, true unit.
  PerTriad<std::optional<double>> residual_rms_before;  ///< The same, uncalibrated.
  double reduced_chi2 = 0.0;                            ///< After excess noise.
  double reduced_chi2_before = 0.0;                     ///< With the noise inside the rests alone.
  double dof = 0.0;                                     ///< Residuals minus parameters.
  double effective_dof = 0.0;  ///< Satterthwaite ν for intervals and joint tests.
  std::vector<WeakDirection> weak_directions;
  std::optional<HeldOut> held_out;
  std::vector<ModelAlternative> model_choice;  ///< Empty unless something was chosen; chosen first.
  /// On the way there: the largest model, then what was taken away or came back, each with the
  /// model after it and the p of that step.
  std::vector<ModelAlternative> model_steps;
  std::vector<RejectedPose> rejected_poses;
  std::vector<TurnCheck> turns;            ///< Those that were stated.
  std::vector<ClockOffset> clock_offsets;  ///< Where moves between rests show them.
  std::vector<Coverage> coverage;
  std::vector<PoseResidual> pose_residuals;
  std::vector<LimitCheck> limits;
  std::vector<TemperatureSetting> temperature_settings;  ///< Of triads with temperature terms.
  std::vector<SweepAxis> sweep;                          ///< Empty but for temperature sweeps.
  std::vector<SweepWindow> sweep_windows;
};

/// Everything calibration.yaml holds.
struct Calibration {
  std::string serial;
  std::string model;
  std::string software_version;
  std::string created;  ///< ISO 8601, UTC.
  std::vector<InputFile> inputs;
  Outcome outcome = Outcome::kNotCalled;
  std::optional<bool> within_limits;
  std::vector<std::string> messages;
  ReferenceValues reference;
  Gauge gauge = Gauge::kAccelX;
  Triad gauge_sensor = Triad::kAccelerometer;
  PerTriad<std::optional<TriadCalibration>> sensors;
  NamedCovariance covariance;
  Quality quality;
  std::string config_yaml;  ///< The resolved experiment, as YAML text.

  bool IsUsable() const { return outcome == Outcome::kConverged; }
};

}  // namespace truetriad
