// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/gauge.h"
#include "truetriad/model/outcome.h"
#include "truetriad/model/terms.h"

namespace truetriad {

/// How much of the sensitivity matrix is estimated.
enum class MatrixModel {
  kBias,      ///< Bias only; the matrix is held (identity in the log's unit, or the prior's value).
  kDiagonal,  ///< Three gains; the axes may be permuted or mirrored.
  kSymmetric,  ///< Gains and three misalignments, rotation held.
  kFull,       ///< All that the gauge leaves free.
  kAuto,       ///< Chosen by comparing nested models.
};
std::string_view MatrixModelName(MatrixModel model);

/// Whether a term beyond bias and sensitivity is estimated.
enum class Wanted {
  kNo,  ///< The term is zero.
  kYes,
  kAuto,  ///< Chosen by comparing models with and without it.
};
std::string_view WantedName(Wanted wanted);  ///< "false", "true", "auto".

/// The reading at rest of an axis that points up: +g (specific force) or -g (gravity).
enum class AccelerometerSign { kSpecificForce, kGravity };

enum class ExcessNoise { kNone, kEstimate, kGiven };

/// A value that is exact, known with a σ, or unknown.
struct Knowledge {
  std::optional<double> value;  ///< nullopt: unknown.
  double sigma = 0.0;           ///< 0: exact.
  bool known() const { return value.has_value(); }
};

/// A data-sheet or batch value of one triad with its σ. An entry with an infinite σ is not a prior.
struct TriadPrior {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // raw
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Matrix3d sensitivity = Eigen::Matrix3d::Identity();  // raw per true unit
  Eigen::Matrix3d sensitivity_sigma =
      Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
};

/// A data sheet's non-linearity: how far a sensor is from its best-fit straight line (least
/// squares, IEEE Std 528) over its range, one σ.
struct Nonlinearity {
  /// A sensor with larger residuals is not linear: the option is refused.
  static constexpr double kMostPercent = 10.0;

  double percent_of_full_scale = 0.0;  ///< 100 % is full_scale. Range: > 0, at most 10.
  double full_scale = 0.0;             ///< The range is ± this, true unit. Range: > 0.

  /// σ of each axis' coefficient a of a term a f(u), raw^-power, as if the term were the only one:
  /// over ± U = `raw_per_true` * full_scale its largest residual is a U^(1 + power) beyond_line.
  double SigmaOf(const AxisTermInfo& term, double raw_per_true) const;
  bool IsValid() const;
};

/// Noise of a triad at rest from an Allan deviation, per axis. allan/allan.h.
struct AllanNoise {
  Eigen::Vector3d white_density_raw = Eigen::Vector3d::Zero();  ///< N, raw unit / sqrt(Hz).
  Eigen::Vector3d instability_raw = Eigen::Vector3d::Zero();    ///< B, raw unit.

  /// σ of a mean over `duration_s` seconds, raw unit: sqrt(N^2 / T + (2 ln 2 / pi) B^2). The mean
  /// reduces white noise, but not the bias instability. Range: duration_s > 0.
  Eigen::Vector3d MeanSigma(double duration_s) const;

  /// Whether all are finite, densities > 0, instabilities >= 0.
  bool IsValid() const;
};

/// Which entries of a sensitivity's temperature terms are free.
enum class ThermalMatrix {
  kFull,      ///< All that the gauge leaves free.
  kDiagonal,  ///< One gain for each axis.
  kScale,     ///< One number: all gains change by the same share.
};
std::string_view ThermalMatrixName(ThermalMatrix shape);

/// The variables of the full second-order regression of a sweep.
enum class RegressionFactor { kReading, kTemperature, kRate, kAmbient, kAmbientRate };
inline constexpr std::size_t kRegressionFactors = 5;  ///< The values of RegressionFactor.
std::string_view RegressionFactorName(RegressionFactor factor);

/// Temperature terms of one triad (model/thermal.h). Terms that are not wanted are zero.
struct ThermalOptions {
  static constexpr int kMaxBiasOrder = 7;    ///< With the constant, 8 unknowns per axis.
  static constexpr int kMaxMatrixOrder = 3;  ///< A full matrix has 9 unknowns per order.

  /// Powers of tau in the bias. Range: 0 to kMaxBiasOrder.
  int bias_order = 0;
  /// Powers of tau in the sensitivity. Range: 0 to kMaxMatrixOrder.
  int matrix_order = 0;
  ThermalMatrix matrix = ThermalMatrix::kFull;
  /// The bias depends on the rate of the temperature.
  PerRateTerm<bool> rate = {};

  // The orders are chosen by significance and held-out error, up to those stated above.
  bool bias_order_auto = false;
  bool rate_auto = false;  ///< Terms of `rate` enter and leave one by one.
  // For poses alone: a sweep does not determine the sensitivity.
  bool matrix_order_auto = false;
  bool matrix_auto = false;  ///< The shape is chosen: kScale, kDiagonal, … up to `matrix`.

  // For a sweep (CalibrateOptions::sweep) alone.
  /// Number of first-order lags between thermometer and element: 0, 1 or 2. model/thermal.h.
  int lags = 0;
  /// Held-out error decides the number of lags.
  bool lags_auto = false;
  /// Temperatures at which the polynomial of the bias changes (ThermalKnot), degC.
  std::vector<double> knots_degc = {};
  /// In place of knots_degc: the number of knots to find, for each axis its own. Range: 0 to 3.
  int find_knots = 0;
  /// Knots change the curvature and not the slope, so that the bias has no kink.
  bool smooth_knots = false;
  /// Factors of a regression that is reported beside the terms (SweepRegression), by
  /// RegressionFactor; all false: none.
  std::array<bool, kRegressionFactors> regression{};

  bool any() const;
  /// Whether an option is set that only a sweep determines.
  bool needs_sweep() const;
  bool has_regression() const;
  bool has_factor(RegressionFactor factor) const {
    return regression[static_cast<std::size_t>(factor)];
  }
  /// Whether orders, rates or the shape of the matrix are to be chosen.
  bool is_open() const;
};

struct TriadOptions {
  /// Calibrate this triad at all.
  bool enabled = false;
  MatrixModel model = MatrixModel::kFull;
  /// Body axes along which the sensing axes point (model/mounting.h); unset: any. For the triad
  /// that defines the body frame it defines that frame, for others it is what a fit must find.
  std::optional<Eigen::Matrix3d> mounting;
  /// `mounting` is not stated, but was found before the fit.
  bool is_mounting_found = false;
  /// Accelerometer only.
  AccelerometerSign sign = AccelerometerSign::kSpecificForce;
  /// σ of one pose mean per axis, raw unit; unset: from the rests (or the table's sigma columns,
  /// or, without either, from the residuals).
  std::optional<Eigen::Vector3d> noise_sigma_raw;
  /// Where noise_sigma_raw came from.
  NoiseSource noise_source = NoiseSource::kConfig;
  /// In place of noise_sigma_raw: σ of each pose mean from its duration, which must be known.
  std::optional<AllanNoise> allan;
  /// Pose-to-pose noise beyond the noise inside a rest.
  ExcessNoise excess = ExcessNoise::kEstimate;
  /// True unit; for ExcessNoise::kGiven.
  double excess_sigma = 0.0;
  std::optional<TriadPrior> prior;
  /// Hold the sensitivity at this value (raw per true unit).
  std::optional<Eigen::Matrix3d> fixed_sensitivity;
  /// Model `auto` only: the matrix of its smallest candidate, `bias`; unset: no such candidate.
  std::optional<Eigen::Matrix3d> nominal_sensitivity;
  /// With several sessions, each has its own bias, and the stated bias is their mean. Unset: true
  /// for the accelerometer and the gyroscope, whose bias changes at switching on.
  std::optional<bool> bias_per_session;
  /// Hold the bias at this value (raw unit).
  std::optional<Eigen::Vector3d> fixed_bias;
  /// Temperature terms about reference.temperature_degc. Every pose then needs a temperature.
  ThermalOptions thermal;
  /// Gyroscope only: whether its readings depend on the specific force.
  Wanted g_sensitivity = Wanted::kNo;
  /// Each term is of one kind of sensor, terms.h. Poses with axes halfway up separate a quadratic
  /// term from bias and gain, turns both ways about each axis separate an asymmetry from the gain.
  PerAxisTerm<Wanted> axis_terms = {};
  /// Nonlinearity for which the model lacks terms: σ grow by what the readings do not exclude.
  std::optional<Nonlinearity> nonlinearity;

  bool HasAxisTerm(Wanted wanted) const {
    return std::find(axis_terms.begin(), axis_terms.end(), wanted) != axis_terms.end();
  }
};

/// The place for which the earth's rotation is added to the gyroscope's model. model/world.h.
struct EarthRateOptions {
  double latitude_rad = 0.0;     ///< Positive in the north.
  double declination_rad = 0.0;  ///< Magnetic from true north, positive to the east.
};

struct ReferenceOptions {
  Knowledge gravity_mps2{kStandardGravityMps2, 0.0};
  /// Unknown: the magnetometer's common scale is not observable; B is fixed to a nominal value.
  Knowledge field_ut;
  Knowledge dip_rad;
  /// Decides between (S_mag, dip) and (-S_mag, -dip), which fit equally, if the dip is unknown.
  /// docs/conventions.md, "Signs".
  bool northern_hemisphere = true;
  /// If false, the hemisphere is a guess, and a magnetometer with all axes reversed is refused.
  bool is_hemisphere_stated = false;
  /// The temperature at which bias and sensitivity are stated with temperature terms (tau = 0).
  double temperature_degc = 25.0;
  /// Unset: the earth's rate is neglected. Needs the heading of every pose in which the gyroscope
  /// rests: from a magnetometer, or from given attitudes, whose common heading is one unknown.
  std::optional<EarthRateOptions> earth_rate;
};

enum class AttitudeKind {
  kNone,     ///< Attitudes are unknowns.
  kSixFace,  ///< Each rest has one body axis up, except for a tilt.
  kGiven,    ///< Each pose carries an AttitudeReference.
};

struct AttitudeOptions {
  AttitudeKind kind = AttitudeKind::kNone;
  /// Six-face: σ of each face's own tilt, shared by all its rests, degrees. Range: > 0.
  double tilt_sigma_deg = 0.5;
  /// The σ as stated, if the poses showed larger tilts: `tilt_sigma_deg` is then the σ found.
  std::optional<double> stated_tilt_sigma_deg;
  /// Six-face: σ of one rest's tilt about that of its face, degrees. Range: >= 0.
  double seat_sigma_deg = 0.05;
  /// Given: the attitudes are those of the body in a fixture of unknown attitude in the world.
  /// Gravity shows its tilt; its heading and that of the field are one unknown.
  bool unknown_fixture_rotation = false;
};

struct RobustOptions {
  /// Off: every pose has full weight and none is rejected.
  bool enabled = true;
  /// Normalised residual at which a pose starts to lose weight. Range: > 0.
  double scale = 3.0;
};

enum class InitialiseMethod {
  kAuto,
  kSixFaceExtremes,
  kSixPosition,
  kEllipsoidAxisAligned,
  kEllipsoid,
};

/// A unit that is tumbled without rests, followed as a chain of attitudes. Needs the accelerometer
/// and the gyroscope (held or not) and PoseSet::tracks.
struct MotionOptions {
  /// Time between two attitudes of the chain, s; rounded to whole readings of the gyroscope, 0 for
  /// every one. No reading is lost: the gyroscope rotates those in between to their node. Range:
  /// >= 0.
  double spacing_s = 0.1;
};

struct InitialiseOptions {
  InitialiseMethod method = InitialiseMethod::kAuto;
  /// Stop at the start values and report them.
  bool only = false;
  /// Known specific force of each pose (body frame, true unit), for the six-position method; empty:
  /// nominal ±g along the face's axis.
  std::vector<Eigen::Vector3d> known_forces;
};

/// "accelerometer.bias" -> the limit of each axis; names: model/limits.h.
struct LimitOptions {
  std::map<std::string, Limit> limits;
  /// A value passes when it is inside by guard_band_k of its σ. Range: >= 0.
  double guard_band_k = 0.0;
};

/// The temperature rises and falls while one or a few attitudes are held: the poses are windows of
/// time (PoseSelectionKind::kSweep), and only what changes with temperature is estimated.
struct SweepOptions {
  /// Bias and sensitivity at the unit's reference temperature, which is then the result's. Without
  /// it accelerometer and magnetometer are held at TriadOptions::fixed_bias (else zero) and
  /// fixed_sensitivity.
  std::optional<Calibration> static_calibration;
  std::string static_file;  ///< For messages.
  /// Windows are weighted by the time spent at their temperature. Off: each by its noise alone.
  bool even_temperatures = true;
};

/// Two ways to find the same optimum.
enum class Solver {
  kEliminated,  ///< The attitudes are eliminated block by block: time is linear in poses.
  kCeres,       ///< Ceres solves the whole problem: slower, a check of kEliminated.
};

struct CalibrateOptions {
  PerTriad<TriadOptions> triads;
  ReferenceOptions reference;
  AttitudeOptions attitudes;
  RobustOptions robust;
  std::optional<MotionOptions> motion;
  std::optional<SweepOptions> sweep;
  InitialiseOptions initialise;
  LimitOptions limits;
  Solver solver = Solver::kEliminated;
  Gauge gauge = Gauge::kAccelX;
  /// The axes of known turns or rates are stated, so that they are the body frame of a gyroscope
  /// alone. Off: only the sizes of its rates are known (StatedRate::is_axis_known).
  bool has_stated_axes = true;
  /// Refuse readings, times and temperatures that are impossible in their unit. Off: stated units
  /// are not questioned (a field in coils, a normalised strength).
  bool check_units = true;
  /// The clock offsets of the sensors that the recording shows are corrected. Off: the offsets are
  /// as `time_offset_s` states, and σ include what remains.
  bool corrects_clocks = true;
  /// A corrected fault refuses the unit if it moves some parameter by more than this many of its σ.
  /// Unset: a corrected fault does not refuse it, the limits decide. Range: >= 0.
  std::optional<double> strict_shift_sigmas;
  /// Folds of the cross-validation over poses; 0: none. Range: 0 or >= 2.
  int cross_validation_folds = 5;
  /// Largest σ along any direction of parameter space, as a share of the signal, at which the
  /// parameters count as determined. Range: (0, 1).
  double observable_sigma = 0.1;

  /// Whether the gyroscope is calibrated without any sensor of gravity or field.
  bool HasGyroscopeAlone() const;
  /// Whether turns are compared with the field, not with gravity: magnetometer and gyroscope,
  /// without accelerometer, in unknown attitudes. The vertical of such a world is the field.
  bool TurnsAgainstField() const;
  /// Whether the body frame is defined from outside: by known attitudes, or for a gyroscope alone
  /// by the axes of its known turns and rates. The leading triad's matrix is then full.
  bool IsBodyKnown() const;
  /// What the poses are: rests, a motion or a temperature sweep.
  Mode mode() const;
  /// Whether temperature terms of some triad are wanted.
  bool HasThermal() const;
  /// Whether the triad has a bias of its own in each session.
  bool HasSessionBias(Triad triad) const;
  /// Whether some model or term is to be chosen by comparing nested models over poses.
  bool HasChoice() const;
  /// Lists every invalid value, or is ok.
  Status Validate() const;
};

}  // namespace truetriad
