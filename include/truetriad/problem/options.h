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
#include "truetriad/model/finding.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// How much of the sensitivity matrix is estimated.
enum class MatrixModel {
  kBias,      ///< Bias only; the matrix is held (identity in the log's unit, or the prior's value).
  kDiagonal,  ///< Three gains; the axes may be permuted or reversed.
  kSymmetric,  ///< Gains and three misalignments, rotation held.
  kFull,       ///< All entries that the gauge leaves free.
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

/// Prior values of a triad, from a data sheet or a batch. An entry with infinite σ has no prior.
struct TriadPrior {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // raw
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Matrix3d sensitivity = Eigen::Matrix3d::Identity();  // raw per true unit
  Eigen::Matrix3d sensitivity_sigma =
      Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
};

/// A data sheet's non-linearity, as one σ: how far the readings deviate from their best-fit
/// straight line (least squares, IEEE Std 528) over the sensor's range.
struct Nonlinearity {
  /// IsValid refuses a larger non-linearity, with which a sensor is not linear at all.
  static constexpr double kMostPercent = 10.0;

  double percent_of_full_scale = 0.0;  ///< 100 % is full_scale. Range: > 0, at most 10.
  double full_scale = 0.0;             ///< The range is ± this, true unit. Range: > 0.

  /// σ of a, raw^-power, if the term a f(u) alone causes the non-linearity: over ±U, U =
  /// `raw_per_true` * full_scale, it deviates from its best line by a U^(1 + power) beyond_line.
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

  /// Whether all values are finite, the densities > 0 and the instabilities >= 0.
  bool IsValid() const;
};

/// Which entries of a sensitivity's temperature terms are free.
enum class ThermalMatrix {
  kFull,      ///< All entries that the gauge leaves free.
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
  /// Which terms in the rate of the temperature the bias has.
  PerRateTerm<bool> rate = {};

  // If a flag is true, significance and held-out error choose the order, up to that stated above.
  bool bias_order_auto = false;
  bool rate_auto = false;  ///< Terms of `rate` are added and removed one by one.
  // These two are not used for a sweep, which does not determine the sensitivity.
  bool matrix_order_auto = false;
  bool matrix_auto = false;  ///< The shape is chosen: kScale, kDiagonal, … up to `matrix`.

  // The rest is used only for a sweep (CalibrateOptions::sweep). Number of first-order lags between
  // thermometer and element: 0, 1 or 2. model/thermal.h.
  int lags = 0;
  /// Held-out error decides the number of lags.
  bool lags_auto = false;
  /// Temperatures at which the polynomial of the bias changes (ThermalKnot), degC.
  std::vector<double> knots_degc = {};
  /// Alternative to knots_degc: the number of knots to find on each axis. Range: 0 to 3.
  int find_knots = 0;
  /// If true, the slope of the bias does not change at a knot, only its curvature.
  bool smooth_knots = false;
  /// Which factors the regression (SweepRegression) has, indexed by RegressionFactor. The
  /// regression is reported in addition to the terms. If all are false, there is no regression.
  std::array<bool, kRegressionFactors> regression{};

  bool any() const;
  /// Whether lags, knots or a regression are wanted, which only a sweep determines.
  bool needs_sweep() const;
  bool has_regression() const;
  bool has_factor(RegressionFactor factor) const {
    return regression[static_cast<std::size_t>(factor)];
  }
  /// Whether orders, rates or the shape of the matrix are to be chosen.
  bool is_open() const;
};

struct TriadOptions {
  /// Whether this triad is calibrated.
  bool enabled = false;
  MatrixModel model = MatrixModel::kFull;
  /// Body axes along which the sensing axes point (model/mounting.h); unset: any axes. If the triad
  /// defines the body frame, its mounting defines that frame; otherwise the fit must agree with it.
  std::optional<Eigen::Matrix3d> mounting;
  /// Whether `mounting` was not stated but found before the fit.
  bool is_mounting_found = false;
  /// Accelerometer only.
  AccelerometerSign sign = AccelerometerSign::kSpecificForce;
  /// σ of a pose mean on each axis, raw unit. Unset: it is taken from the readings within the
  /// rests, from the sigma columns of a table or, if both are missing, from the residuals.
  std::optional<Eigen::Vector3d> noise_sigma_raw;
  /// Where noise_sigma_raw came from.
  NoiseSource noise_source = NoiseSource::kConfig;
  /// Alternative to noise_sigma_raw: the σ follows from the pose's duration, which must be known.
  std::optional<AllanNoise> allan;
  /// Pose-to-pose noise beyond the noise inside a rest.
  ExcessNoise excess = ExcessNoise::kEstimate;
  /// σ of the excess noise for ExcessNoise::kGiven, true unit.
  double excess_sigma = 0.0;
  std::optional<TriadPrior> prior;
  /// If set, the sensitivity is held at this value (raw per true unit).
  std::optional<Eigen::Matrix3d> fixed_sensitivity;
  /// For the model `auto`: the matrix that its candidate `bias` holds; unset: `bias` is no
  /// candidate.
  std::optional<Eigen::Matrix3d> nominal_sensitivity;
  /// Whether each session has a bias of its own; the result is then the mean of these biases.
  /// Unset: true for accelerometer and gyroscope, whose bias changes at each switching on.
  std::optional<bool> bias_per_session;
  /// If set, the bias is held at this value (raw unit).
  std::optional<Eigen::Vector3d> fixed_bias;
  /// Temperature terms, zero at reference.temperature_degc. With them, every pose needs a
  /// temperature.
  ThermalOptions thermal;
  /// Gyroscope only: whether its readings depend on the specific force.
  Wanted g_sensitivity = Wanted::kNo;
  /// Each term belongs to one kind of sensor (terms.h). Poses with axes halfway up separate a
  /// quadratic term from bias and gain; turns in both directions separate an asymmetry from the
  /// gain.
  PerAxisTerm<Wanted> axis_terms = {};
  /// A nonlinearity that the model lacks. The σ include the part that the readings do not exclude.
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
  /// If it is unknown, the magnetometer's common scale is unobservable; B is held at a nominal
  /// value.
  Knowledge field_ut;
  Knowledge dip_rad;
  /// If the dip is unknown, decides between (S_mag, dip) and (-S_mag, -dip), which fit equally
  /// well. docs/conventions.md, "Signs".
  bool northern_hemisphere = true;
  /// If false, the hemisphere is a guess, and a magnetometer with all axes reversed is refused.
  bool is_hemisphere_stated = false;
  /// With temperature terms: the temperature at which bias and sensitivity are stated (tau = 0).
  double temperature_degc = 25.0;
  /// Unset: the earth's rate is neglected. If set, every pose with a gyroscope reading needs a
  /// heading: from a magnetometer, or from given attitudes with one common unknown heading.
  std::optional<EarthRateOptions> earth_rate;
};

enum class AttitudeKind {
  kNone,     ///< Attitudes are unknowns.
  kSixFace,  ///< Each rest has one body axis up, except for a tilt.
  kGiven,    ///< Each pose carries an AttitudeReference.
};

struct AttitudeOptions {
  AttitudeKind kind = AttitudeKind::kNone;
  /// Six-face: σ of the tilt of a face, which all rests on that face share, degrees. Range: > 0.
  double tilt_sigma_deg = 0.5;
  /// The stated σ, if poses showed larger tilts; unset otherwise. `tilt_sigma_deg` is the σ used.
  std::optional<double> stated_tilt_sigma_deg;
  /// Six-face: σ of a rest's tilt relative to the tilt of its face, degrees. Range: >= 0.
  double seat_sigma_deg = 0.05;
  /// Given attitudes: they are relative to a fixture whose own attitude is unknown. Gravity shows
  /// the fixture's tilt; the headings of fixture and field are one unknown.
  bool unknown_fixture_rotation = false;
};

struct RobustOptions {
  /// If false, every pose has full weight and none is rejected.
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

/// A unit that is tumbled without rests: its motion is a chain of attitudes. Needs PoseSet::tracks,
/// the gyroscope, and the accelerometer or the magnetometer; their parameters may be held.
struct MotionOptions {
  /// Time between two attitudes of the chain, s, rounded to a whole number of gyroscope readings;
  /// 0: one attitude per reading. Readings between two attitudes are also used: they are rotated to
  /// one of the attitudes by the gyroscope. Range: >= 0.
  double spacing_s = 0.1;
};

struct InitialiseOptions {
  InitialiseMethod method = InitialiseMethod::kAuto;
  /// Whether to stop at the start values and report them.
  bool only = false;
  /// Known specific force of each pose (body frame, true unit), for the six-position method; empty:
  /// nominal ±g along the face's axis.
  std::vector<Eigen::Vector3d> known_forces;
};

/// "accelerometer.bias" -> the limit of each axis; names: model/limits.h.
struct LimitOptions {
  std::map<std::string, Limit> limits;
  /// A value passes if it is inside its limit by at least guard_band_k times its σ. Range: >= 0.
  double guard_band_k = 0.0;
};

/// The temperature rises and falls while the unit is held in one or a few attitudes. The poses are
/// windows of time (PoseSelectionKind::kSweep), and only changes with temperature are estimated.
struct SweepOptions {
  /// Bias and sensitivity at the unit's reference temperature, which becomes that of the result.
  /// Unset: accelerometer and magnetometer are held at TriadOptions::fixed_bias (zero if that is
  /// unset) and at fixed_sensitivity.
  std::optional<Calibration> static_calibration;
  std::string static_file;  ///< For messages.
  /// If true, every range of temperatures has the same weight; if false, every reading has.
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
  /// The axes of known turns or rates are stated; they define the body frame of a gyroscope that is
  /// calibrated alone. If false, only the magnitudes of its rates are known
  /// (StatedRate::is_axis_known).
  bool has_stated_axes = true;
  /// Whether readings, times and temperatures that are impossible in their unit are refused. If
  /// false, stated units are accepted as they are (for a field in coils or a normalised strength).
  bool check_units = true;
  /// Whether clock offsets between sensors that the recording shows are corrected. If false, only
  /// the offsets that `time_offset_s` states are, and σ include the effect of any further offset.
  bool corrects_clocks = true;
  /// If a corrected fault moves some parameter by more than this many σ of that parameter, the unit
  /// is refused. Unset: no corrected fault refuses the unit, and the limits decide. Range: >= 0.
  std::optional<double> strict_shift_sigmas;
  /// Folds of the cross-validation over poses; 0: none. Range: 0 or >= 2.
  int cross_validation_folds = 5;
  /// The parameters count as determined if σ along every direction of parameter space is at most
  /// this share of the signal. Range: (0, 1).
  double observable_sigma = 0.1;

  /// Whether the gyroscope is calibrated without any sensor of gravity or field.
  bool HasGyroscopeAlone() const;
  /// Whether turns are compared with the field, not with gravity: magnetometer and gyroscope,
  /// without accelerometer, in unknown attitudes. The world frame's vertical is then the field.
  bool TurnsAgainstField() const;
  /// Whether the body frame is defined from outside: by known attitudes, or for a gyroscope alone
  /// by the axes of its known turns and rates. The leading triad's matrix is then full, not
  /// triangular.
  bool IsBodyKnown() const;
  /// What the poses are: rests, a motion or a temperature sweep.
  Mode mode() const;
  /// Whether temperature terms of some triad are wanted.
  bool HasThermal() const;
  /// Whether the triad has a bias of its own in each session.
  bool HasSessionBias(Triad triad) const;
  /// Whether some model or term is to be chosen by comparing nested models over poses.
  bool HasChoice() const;
  /// Ok, or an error that lists every invalid value.
  Status Validate() const;
};

}  // namespace truetriad
