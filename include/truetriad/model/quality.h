// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/model/coverage.h"
#include "truetriad/model/limits.h"

namespace truetriad {

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

/// The bias of a sensor in one of several sessions. Raw unit.
struct SessionBias {
  int session = 0;   ///< From 1 on.
  std::string file;  ///< Its recording.
  Triad triad = Triad::kAccelerometer;
  int poses = 0;  ///< In which the sensor was seen.
  Eigen::Vector3d bias_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Zero();
};

/// How a sensor's bias scatters from session to session, beyond what each is known to. Raw unit.
struct BiasRepeatability {
  Triad triad = Triad::kAccelerometer;
  int sessions = 0;
  Eigen::Vector3d value_raw = Eigen::Vector3d::Zero();  ///< One σ of a session.
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Zero();  ///< Of that, by how few sessions show it.
  /// How far the bias of a session to come is from the stated mean, one σ.
  Eigen::Vector3d next_session_raw = Eigen::Vector3d::Zero();
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

/// One of the numbers that a limit is for, where it is worst.
struct LimitComponent {
  std::string component;  ///< "x", "xy"; empty of a scalar.
  double value = 0.0, sigma = 0.0;
  double outside = 0.0;  ///< Probability that its true value is outside.
  bool pass = false;
};

/// A limit and the worst of the numbers that it is for, in the unit of its quantity.
struct LimitCheck {
  std::string name;  ///< "accelerometer.bias", "accelerometer.bias.x".
  std::string
      component;  ///< Of the worst: "x", "xy"; empty where the name has it, or for a scalar.
  Limit limit;
  double worst = 0.0;  ///< The value nearest to a limit with its guard band, or furthest beyond.
  double sigma = 0.0;  ///< Its σ.
  /// Probability that the true value is outside, of any component if there are several (as if they
  /// were independent), each at its worst temperature.
  double outside = 0.0;
  bool pass = false;
  double guard_band_k = 0.0;  ///< The value with so many σ about it must be inside.
  std::vector<LimitComponent> components = {};  ///< All of them; not in files.

  std::string FullName() const { return component.empty() ? name : name + "." + component; }
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

/// One term that the model does not have: what the readings say of it, and what it might do unseen.
struct LeftOutTest {
  Triad triad = Triad::kAccelerometer;
  std::string term;       ///< "quadratic", "bias drift".
  double p_value = 1.0;   ///< Of the test, beside those that show.
  bool is_shown = false;  ///< It is corrected, or σ allow for it.
  /// By how many of its σ some parameter is off at most for each σ by which the term does not show;
  /// unset where the readings tell nothing of some of it.
  std::optional<double> kappa;
};

/// What rests have beyond any other data.
struct RestQuality {
  std::optional<HeldOut> held_out;
  std::vector<ModelAlternative> model_choice;  ///< Empty unless something was chosen; chosen first.
  /// On the way there: the largest model, then what was taken away or came back, each with the
  /// model after it and the p of that step.
  std::vector<ModelAlternative> model_steps;
  std::vector<RejectedPose> rejected_poses;
  std::vector<TurnCheck> turns;            ///< Those that were stated.
  std::vector<ClockOffset> clock_offsets;  ///< Where moves between rests show them.
  /// Of sensors with a bias for each session; that of the sensor is their mean.
  std::vector<SessionBias> sessions;
  std::vector<BiasRepeatability> repeatability;
  std::vector<PoseResidual> pose_residuals;
  std::vector<TemperatureSetting> temperature_settings;  ///< Of triads with temperature terms.
};

/// What a temperature sweep has.
struct SweepQuality {
  std::vector<SweepAxis> axes;
  std::vector<SweepWindow> windows;
};

/// How well the solution explains the data, and what supports it. The common part is all that a
/// unit followed through its motion has.
struct Quality {
  int poses = 0;                                        ///< Rests, attitudes of a motion, windows.
  PerTriad<std::optional<double>> residual_rms;         ///< RMS of |C(y-b)| - reference, true unit.
  PerTriad<std::optional<double>> residual_rms_before;  ///< The same, uncalibrated.
  double reduced_chi2 = 0.0;                            ///< After excess noise.
  double reduced_chi2_before = 0.0;                     ///< With the noise inside the rests alone.
  double dof = 0.0;                                     ///< Residuals minus parameters.
  double effective_dof = 0.0;  ///< Satterthwaite ν for intervals and joint tests.
  std::vector<WeakDirection> weak_directions;
  std::vector<LeftOutTest> left_out_tests;
  std::vector<Coverage> coverage;
  std::vector<LimitCheck> limits;
  RestQuality rests;   ///< Empty but for Mode::kPoses.
  SweepQuality sweep;  ///< Empty but for Mode::kSweep.
};

}  // namespace truetriad
