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
  kNo,  ///< There is none: it is zero.
  kYes,
  kAuto,  ///< Chosen by comparing models with and without it.
};
std::string_view WantedName(Wanted wanted);  ///< "false", "true", "auto".

/// +g on the axis that points up (specific force), or the opposite (gravity).
enum class AccelerometerSign { kSpecificForce, kGravity };

enum class ExcessNoise { kNone, kEstimate, kGiven };

/// A value that is exact, known with a σ, or unknown.
struct Knowledge {
  std::optional<double> value;  ///< nullopt: unknown.
  double sigma = 0.0;           ///< 0: exact.
  bool known() const { return value.has_value(); }
};

/// A data-sheet or batch value of one triad with its σ. Entries with an infinite σ carry nothing.
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
  /// What is further off is no linear sensor.
  static constexpr double kMostPercent = 10.0;

  double percent_of_full_scale = 0.0;  ///< Of one end of the range. Range: > 0, at most 10.
  double full_scale = 0.0;             ///< The range is ± this, true unit. Range: > 0.

  /// σ of each axis' coefficient of a term that may be all of it, raw^-power: a f(u) over ± U =
  /// `raw_per_true` * full_scale leaves a U^(1 + power) beyond_line, which is this share of U.
  double SigmaOf(const AxisTermInfo& term, double raw_per_true) const;
  bool IsValid() const;
};

/// Noise of a triad at rest from an Allan deviation, per axis. data/allan.h.
struct AllanNoise {
  Eigen::Vector3d white_density_raw = Eigen::Vector3d::Zero();  ///< N, raw unit / sqrt(Hz).
  Eigen::Vector3d instability_raw = Eigen::Vector3d::Zero();    ///< B, raw unit.

  /// σ of a mean over `duration_s` seconds, raw unit: sqrt(N^2 / T + (2 ln 2 / pi) B^2). The white
  /// part averages out, the floor of the Allan deviation does not. Range: duration_s > 0.
  Eigen::Vector3d MeanSigma(double duration_s) const;

  /// All finite, densities > 0, instabilities >= 0.
  bool IsValid() const;
};

/// Which entries of a sensitivity's temperature terms are free.
enum class ThermalMatrix {
  kFull,      ///< All that the gauge leaves free.
  kDiagonal,  ///< A gain an axis.
  kScale,     ///< One number: all gains change by the same share.
};
std::string_view ThermalMatrixName(ThermalMatrix shape);

/// What a full second-order regression of a sweep has its terms in.
enum class RegressionFactor { kReading, kTemperature, kRate, kAmbient, kAmbientRate };
inline constexpr std::size_t kRegressionFactors = 5;
std::string_view RegressionFactorName(RegressionFactor factor);

/// Temperature terms of one triad (model/thermal.h). Terms that are not wanted are zero.
struct ThermalOptions {
  static constexpr int kMaxBiasOrder = 7;
  static constexpr int kMaxMatrixOrder = 3;

  /// Powers of tau in the bias. Range: 0 to kMaxBiasOrder.
  int bias_order = 0;
  /// Powers of tau in the sensitivity. Range: 0 to kMaxMatrixOrder.
  int matrix_order = 0;
  ThermalMatrix matrix = ThermalMatrix::kFull;
  /// Bias by the rate of temperature.
  PerRateTerm<bool> rate = {};

  // Chosen by what significance and held-out error speak for, up to what is stated above.
  bool bias_order_auto = false;
  bool rate_auto = false;  ///< Entered and removed one by one.
  // Of poses alone: a sweep tells nothing about the sensitivity.
  bool matrix_order_auto = false;
  bool matrix_auto = false;  ///< From one share for all gains over a gain an axis to `matrix`.

  // Of a sweep (CalibrateOptions::sweep) alone.
  /// First-order lags between thermometer and element: 0, 1 or 2. model/thermal.h.
  int lags = 0;
  /// As many as held-out error speaks for.
  bool lags_auto = false;
  /// Temperatures at which the bias changes its course (ThermalKnot), degC.
  std::vector<double> knots_degc = {};
  /// In place of knots_degc: how many are to be found, each axis its own. Range: 0 to 3.
  int find_knots = 0;
  /// Knots change the curvature alone, not the slope: no kink.
  bool smooth_knots = false;
  /// Factors of a regression that is reported beside the terms (SweepRegression), by
  /// RegressionFactor; all false: none.
  std::array<bool, kRegressionFactors> regression{};

  bool any() const;
  /// What only a sweep tells.
  bool needs_sweep() const;
  bool has_regression() const;
  bool has_factor(RegressionFactor factor) const {
    return regression[static_cast<std::size_t>(factor)];
  }
  /// Orders, rates or the shape of the matrix are left to be chosen.
  bool is_open() const;
};

struct TriadOptions {
  /// Calibrate this triad at all.
  bool enabled = false;
  MatrixModel model = MatrixModel::kFull;
  /// Body axes along which the sensing axes point (model/mounting.h); unset: any. Of the triad that
  /// defines the body frame it says where that frame is, of the others what a fit must find.
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
  /// Model `auto` only: the matrix of its smallest candidate, `bias`; unset: there is no such one.
  std::optional<Eigen::Matrix3d> nominal_sensitivity;
  /// Over several sessions: a bias for each, of which the stated one is the mean. Unset: where
  /// switching on changes it, in the accelerometer and the gyroscope.
  std::optional<bool> bias_per_session;
  /// Hold the bias at this value (raw unit).
  std::optional<Eigen::Vector3d> fixed_bias;
  /// Temperature terms about reference.temperature_degc. Every pose then needs a temperature.
  ThermalOptions thermal;
  /// Gyroscope only: how its readings follow the specific force.
  Wanted g_sensitivity = Wanted::kNo;
  /// Each of the one kind of sensor that may have it, terms.h. Poses with axes halfway up tell a
  /// quadratic term from bias and gain, turns both ways about each axis an asymmetry from the gain.
  PerAxisTerm<Wanted> axis_terms = {};
  /// What the bends may be that the model leaves out: σ grow by what the readings leave of it.
  std::optional<Nonlinearity> nonlinearity;

  bool HasAxisTerm(Wanted wanted) const {
    return std::find(axis_terms.begin(), axis_terms.end(), wanted) != axis_terms.end();
  }
};

/// Where the earth's rotation is counted in what a gyroscope reads. model/world.h.
struct EarthRateOptions {
  double latitude_rad = 0.0;     ///< Positive in the north.
  double declination_rad = 0.0;  ///< Of magnetic north, east positive.
};

struct ReferenceOptions {
  Knowledge gravity_mps2{kStandardGravityMps2, 0.0};
  /// Unknown: the magnetometer's common scale is not observable; B is fixed to a nominal value.
  Knowledge field_ut;
  Knowledge dip_rad;
  /// Settles the sign (S_mag, dip) ~ (-S_mag, -dip) when the dip is unknown. docs/method.md,
  /// "Signs".
  bool northern_hemisphere = true;
  /// Else that is a guess: a magnetometer that comes out all reversed is refused.
  bool is_hemisphere_stated = false;
  /// Where bias and sensitivity are stated when there are temperature terms: tau = T - this.
  double temperature_degc = 25.0;
  /// Unset: the earth stands still. Needs the heading of every pose that the gyroscope rests in:
  /// from a magnetometer, or with attitudes from outside, whose own heading is one unknown.
  std::optional<EarthRateOptions> earth_rate;
};

enum class AttitudeKind {
  kNone,     ///< Attitudes are unknowns.
  kSixFace,  ///< Each rest has one body axis up, within a tilt.
  kGiven,    ///< Each pose carries an AttitudeReference.
};

struct AttitudeOptions {
  AttitudeKind kind = AttitudeKind::kNone;
  /// Six-face: σ of each face's own tilt, shared by all its rests, degrees. Range: > 0.
  double tilt_sigma_deg = 0.5;
  /// Where the poses showed larger tilts than were stated, and `tilt_sigma_deg` is theirs.
  std::optional<double> stated_tilt_sigma_deg;
  /// Six-face: scatter of one rest about its face, degrees. Range: >= 0.
  double seat_sigma_deg = 0.05;
  /// Given: the attitudes are those of the body in a fixture that stands in the world in an unknown
  /// way. Gravity shows its tilt; its heading and that of the field are one unknown.
  bool unknown_fixture_rotation = false;
};

struct RobustOptions {
  /// Off: every pose counts fully and none is rejected.
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
  /// every one. The readings in between lose nothing: they are turned to their node by the
  /// gyroscope. Range: >= 0.
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

/// "accelerometer.bias" -> what each axis may be; names: model/limits.h.
struct LimitOptions {
  std::map<std::string, Limit> limits;
  /// 0: a value passes when it is inside. k: when it is inside by k σ.
  double guard_band_k = 0.0;
};

/// One or a few attitudes held while the temperature goes up and down: the poses of the set are
/// windows of time (PoseSelectionKind::kSweep), and only what changes with temperature is
/// estimated.
struct SweepOptions {
  /// Bias and sensitivity of the unit at its reference temperature, which then is that of the
  /// result. Without one the accelerometer and the magnetometer have the bias of
  /// TriadOptions::fixed_bias (else zero) and fixed_sensitivity, both held.
  std::optional<Calibration> static_calibration;
  std::string static_file;  ///< For messages.
  /// Windows weigh by the time spent at their temperature. Off: each by its noise alone.
  bool even_temperatures = true;
};

/// Two ways to the same optimum.
enum class Solver {
  kEliminated,  ///< The attitudes eliminated block by block: linear in the number of poses.
  kCeres,       ///< The whole problem by Ceres as it is: slower, the reference of the other.
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
  /// Axes of known turns or rates are stated, so that a gyroscope alone has them as its body frame.
  /// Off: only the sizes of its rates are known (StatedRate::is_axis_known).
  bool has_stated_axes = true;
  /// Refuse readings, times and temperatures that cannot be in their unit. Off: what is stated is
  /// taken at its word (a field in coils, a normalised strength).
  bool check_units = true;
  /// Clocks of the sensors that the recording shows to differ are corrected. Off: they are what
  /// `time_offset_s` says, and σ allow for what it leaves.
  bool corrects_clocks = true;
  /// A fault that was corrected refuses the unit where it moves some parameter by more of its σ
  /// than this. Unset: what is corrected is no reason to refuse, the limits decide. Range: >= 0.
  std::optional<double> strict_shift_sigmas;
  /// Folds of the cross-validation over poses; 0: none. Range: 0 or >= 2.
  int cross_validation_folds = 5;
  /// Largest σ along any direction of parameter space, as a share of the signal, at which the
  /// parameters still count as determined. Range: (0, 1).
  double observable_sigma = 0.1;

  /// The gyroscope is calibrated, and nothing that sees gravity or the field with it.
  bool HasGyroscopeAlone() const;
  /// Turns are measured against the magnetic field, not gravity: magnetometer and gyroscope without
  /// accelerometer in unknown attitudes. The vertical of such a world is the field.
  bool TurnsAgainstField() const;
  /// Something outside defines the body frame: known attitudes, or for a gyroscope alone the axes
  /// of its known turns and rates. The leading triad's matrix is then full.
  bool IsBodyKnown() const;
  /// What the poses are: rests, a motion or a temperature sweep.
  Mode mode() const;
  /// Temperature terms are wanted of some triad.
  bool HasThermal() const;
  /// Each session has a bias of its own.
  bool HasSessionBias(Triad triad) const;
  /// Some model or term is to be chosen by comparing nested models over poses.
  bool HasChoice() const;
  /// Every problem with its value, or ok.
  Status Validate() const;
};

}  // namespace truetriad
