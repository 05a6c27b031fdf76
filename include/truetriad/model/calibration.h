// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/quality.h"
#include "truetriad/model/tags.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// The body frame, one of several equivalent ones, in which a result is stated. Static readings
/// leave one common rotation of all triads undetermined; the leading triad fixes it.
/// docs/method.md, "Gauge".
enum class Gauge {
  kAccelX,     ///< Leading sensitivity lower triangular: body x along the x sensing axis.
  kAccelZ,     ///< Leading sensitivity upper triangular. Tedaldi et al. 2014.
  kSymmetric,  ///< Leading sensitivity symmetric: the smallest rotation from the sensor's own axes.
  kFixture,    ///< Known attitudes define the body frame: leading sensitivity full.
};

std::string_view GaugeName(Gauge gauge);
std::optional<Gauge> GaugeFromName(std::string_view name);

/// The rotation Q for which `sensitivity * Q` has the form that `gauge` asks of the leading triad.
/// `axis_sign` (+1, or -1 for a chip that reports gravity) is the sign of the first two (accel-x)
/// or the last two (accel-z) diagonal entries; the sign of the remaining entry makes det Q = +1,
/// even for left-handed triads. For kFixture, Q is the identity.
Eigen::Matrix3d GaugeRotation(Gauge gauge,
                              const Eigen::Matrix3d& leading_sensitivity,
                              double axis_sign = 1.0);

/// Derivative of the rotation: for a change dS of the leading sensitivity, Q changes by
/// Q * [omega]_x with omega = Jacobian * vec(dS) (3x9, vec column-major).
Eigen::Matrix<double, 3, 9> GaugeRotationJacobian(Gauge gauge,
                                                  const Eigen::Matrix3d& leading_sensitivity,
                                                  const Eigen::Matrix3d& rotation);

/// The mounting of a triad: a signed permutation of axes whose row i is the body axis along which
/// sensing axis i points, so that sensitivity = gains * map apart from misalignment. Its text
/// "+y+x-z" means: sensing x along body +y, y along +x, z along -z. AxisMapFromName also reads
/// names of MAVLink's MAV_SENSOR_ORIENTATION, such as "ROTATION_ROLL_180_YAW_90", if the rotation
/// is by quarter turns.
std::string AxisMapName(const Eigen::Matrix3d& map);
std::optional<Eigen::Matrix3d> AxisMapFromName(std::string_view name);

/// All 48 signed permutations, identity first; the right-handed ones have determinant +1.
std::vector<Eigen::Matrix3d> AllAxisMaps();

/// The signed permutation nearest to `matrix` with its rows scaled to length 1.
Eigen::Matrix3d NearestAxisMap(const Eigen::Matrix3d& matrix);

/// The number of rows in which two maps differ.
int AxesThatDiffer(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

/// Gravity at a place, and the Earth's magnetic field of core and crust there.

/// A place on WGS 84.
struct EarthPlace {
  double latitude_deg = 0.0;   ///< -90 to 90, positive in the north.
  double longitude_deg = 0.0;  ///< East positive.
  double height_m = 0.0;       ///< Above the ellipsoid.
};

/// Typical difference between gravity and the normal gravity of the ellipsoid (50 mGal).
inline constexpr double kNormalGravitySigmaMps2 = 5e-4;

/// Normal gravity of WGS 84, m/s^2.
double NormalGravityMps2(double latitude_deg, double height_m);

/// The Earth's magnetic field away from iron and currents. The σ are those of the model; they
/// include the crust and the average disturbance from ionosphere and magnetosphere.
struct EarthField {
  double strength_ut = 0.0;
  double dip_deg = 0.0;          ///< Positive where the field points down.
  double declination_deg = 0.0;  ///< Angle from true north to magnetic north, positive to the east.
  double strength_sigma_ut = 0.0;
  double dip_sigma_deg = 0.0;
  double declination_sigma_deg = 0.0;
};

/// The day `date`, "2026-01-31", as a year with fraction: 2026.0 is the first of January.
/// Error (bad input): not a day of the calendar in this form.
Result<double> DecimalYear(const std::string& date);

/// The World Magnetic Model 2025 at `place`. Error (bad input): a year outside of 2025.0 to 2030.0,
/// or data files that are missing (FindSharedFile) or damaged.
Result<EarthField> WorldMagneticModel(const EarthPlace& place, double year);

/// The origin of the noise by which a triad was weighted.
enum class NoiseSource { kStatic, kAllan, kDatasheet, kConfig, kResidual };
std::string_view NoiseSourceName(NoiseSource source);
std::optional<NoiseSource> NoiseSourceFromName(std::string_view name);

/// Noise of one triad, as used for its weights.
struct TriadNoise {
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();  ///< σ of a rest's mean, RMS over the rests,
                                                    ///< raw.
  NoiseSource source = NoiseSource::kStatic;
  double excess_sigma = 0.0;  ///< Pose-to-pose excess σ, isotropic, true unit.
  double excess_dof = 0.0;    ///< Degrees of freedom of excess_sigma.
  /// Gyroscope: excess σ of a turn about each axis, beyond the noise of the readings, rad.
  double turn_excess_sigma_rad = 0.0;
};

/// A kink in the bias of one axis over temperature: above `degc`, slope (T - degc) + curve (T -
/// degc)^2 is added. The sum's value at the reference temperature is subtracted at all
/// temperatures.
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
  std::vector<Eigen::Matrix3d> sensitivity;  ///< For tau^1, …; raw per true unit / degC^i.
  PerRateTerm<std::optional<Eigen::Vector3d>> rate;  ///< raw / (degC/s), …: terms.h.
  /// First-order lags of each axis, s (model/thermal.h); unset: no lag. The element's temperature
  /// lags behind the thermometer's; the rate in the bias terms lags behind that of the element's
  /// temperature.
  std::optional<Eigen::Vector3d> element_lag_s, rate_lag_s;
  /// Half-width of the window that smoothed the temperature to obtain its rate, s; 0: not stated.
  double smoothing_s = 0.0;
  std::vector<ThermalKnot> knots = {};
  /// Lowest and highest rate that occurred in a sweep, degC/s; unset: not stated.
  std::optional<Eigen::Vector2d> rate_range_degcps = {};
};

/// The calibration of one triad.
struct TriadCalibration {
  std::string input_unit;
  std::string output_unit;
  TriadModel<double> model;  ///< Bias (raw), sensitivity (raw per true unit), axis terms.
  /// Body axes along which the sensing axes point (model/mounting.h): the stated mounting or,
  /// without one, the mounting found.
  Eigen::Matrix3d mounting = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sensitivity_sigma = Eigen::Matrix3d::Zero();
  /// σ of each axis term's coefficients; unset if the model lacks the term.
  PerAxisTerm<std::optional<Eigen::Vector3d>> axis_term_sigma;
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<ThermalTerms> thermal;
  std::optional<double> si_per_count;  ///< True units per count, when the recording stated it.
  TriadNoise noise;

  /// The sensitivity to truth along the intended sensing axes: S transpose(M), M the mounting.
  Eigen::Matrix3d BySensingAxes() const { return model.sensitivity * mounting.transpose(); }
  /// Gains: the diagonal of S transpose(M), negative for an axis that reads with opposite sign.
  Eigen::Vector3d Scale() const { return BySensingAxes().diagonal(); }
  /// K^-1 S transpose(M) - I with K = diag(S transpose(M)), rad.
  Eigen::Matrix3d MisalignmentRad() const;
};

/// Covariance of all `parameters`, in the stated gauge; singular if entries are fixed or tied.
struct NamedCovariance {
  std::vector<std::string>
      parameters;  ///< "accelerometer.bias.x", "magnetometer.sensitivity.zz", …
  Eigen::MatrixXd matrix;

  /// Standard uncertainty of an entry by its name; zero if it is not listed.
  double Sigma(const std::string& parameter) const;
};

/// The reference quantities of the surroundings.
struct ReferenceValues {
  double gravity_mps2 = kStandardGravityMps2;
  std::optional<double> gravity_sigma_mps2;  ///< Prior σ; unset: exact.
  std::optional<double> field_ut;  ///< Field strength, used or estimated; only with a magnetometer.
  std::optional<double> dip_rad;
  bool field_estimated = false;  ///< Strength or dip was estimated.
  /// The strength is nominal: the magnetometer's common scale is not observable.
  bool field_nominal = false;
  /// Rotation fixture <- world as qw, qx, qy, qz, if the fixture's attitude was estimated. World x
  /// is magnetic north if there is a magnetometer, otherwise the horizontal direction of the
  /// fixture's x.
  std::optional<Eigen::Vector4d> fixture_from_world;
  double temperature_degc = 25.0;
  /// Temperatures recorded at the poses: lowest, mean, highest; unset without a thermometer.
  std::optional<Eigen::Vector3d> recorded_degc = {};
};

/// A decision about a unit after its run. It overrides the verdict that follows from the limits.
struct Decision {
  Verdict verdict = Verdict::kFail;  ///< kPass: it may be shipped; kFail: it may not.
  std::string who, why;
  std::string created;  ///< ISO 8601, UTC.
  /// Made by a later run of the unit or by another sensor of the device, not by a person.
  bool is_automatic = false;
};

/// Everything calibration.yaml holds.
struct Calibration {
  std::string serial;
  std::string model;
  Tags tags;
  std::string software_version;
  std::string created;  ///< ISO 8601, UTC.
  std::vector<InputFile> inputs;
  Mode mode = Mode::kPoses;
  Outcome outcome = Outcome::kNotCalled;  ///< Derived from the findings.
  std::optional<bool> within_limits;
  Findings findings;
  ReferenceValues reference;
  Gauge gauge = Gauge::kAccelX;
  Triad gauge_sensor = Triad::kAccelerometer;
  PerTriad<std::optional<TriadCalibration>> sensors;
  NamedCovariance covariance;
  Quality quality;
  std::string config_yaml;          ///< The resolved experiment, as YAML text.
  std::vector<Decision> decisions;  ///< In the order in which they were made: the last one holds.

  bool IsUsable() const { return outcome == Outcome::kConverged; }
  /// Verdict of the last decision; without a decision, the verdict that follows from the limits.
  Verdict verdict() const {
    return IsUsable() && !decisions.empty() ? decisions.back().verdict : LimitsVerdict();
  }
  Verdict LimitsVerdict() const {
    if (!IsUsable()) return Verdict::kNoResult;
    if (!within_limits) return Verdict::kNoLimits;
    return *within_limits ? Verdict::kPass : Verdict::kFail;
  }
  /// The code of the first refusal ("wrong-unit"); if no refusal has a code, the outcome's name.
  std::string_view ReasonNotUsable() const {
    const Finding* refusal = FirstRefusal(findings);
    return refusal == nullptr || refusal->code == FindingCode::kMessage
               ? OutcomeName(outcome)
               : FindingCodeName(refusal->code);
  }
};

/// For each axis of a triad, the temperature on which its parameters depend, and the rate of this
/// temperature.
struct ThermalState {
  Eigen::Vector3d degc = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_degcps = Eigen::Vector3d::Zero();
};

/// The model of a triad at temperature T that changes at rate T' (degC/s); docs/method.md,
/// "Temperature":
///
///   b(T, T') = b0 + sum_i b_i tau^i + d1 T' + d2 T'^2 + f tau T'
///   S(T)     = S0 + sum_i S_i tau^i                                  tau = T - reference
///
/// `at_reference` is (S0, b0). The temperature is not clamped to `thermal.range_degc`.
TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      double temperature_degc,
                                      double rate_degcps = 0.0);

/// The same with separate temperatures and rates for the axes (rows of S).
TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      const ThermalState& state);

/// A first-order lag, lag dy/dt = x - y; exact if the input is linear between readings. The output
/// starts at the first input. If the lag is 0, the output is the input.
class FirstOrderLag {
 public:
  explicit FirstOrderLag(double lag_s) : lag_s_(lag_s) {}
  double Next(double time_s, double input);
  double lag_s() const { return lag_s_; }

 private:
  double lag_s_;
  double time_s_ = 0.0, input_ = 0.0, value_ = 0.0;
  bool started_ = false;
};

/// Computes the temperature and the rate of each axis from a thermometer's reading T:
///
///   element temperature  E: lag_e E' = T - E            lag_e = 0: E = T
///   its rate             (E - F) / lag_r,  lag_r F' = E - F
///
/// (E - F) / lag_r is E' behind a first-order lag. If lag_r is 0, the rate is E' = (T - E) / lag_e;
/// if lag_e is 0, too, lag_r is `smoothing_s`.
class TemperatureFilter {
 public:
  explicit TemperatureFilter(const ThermalTerms& thermal);
  /// Times must not decrease; a temperature of NaN leaves the state unchanged.
  const ThermalState& Next(double time_s, double temperature_degc);

 private:
  std::array<FirstOrderLag, 3> element_, rate_;
  ThermalState state_;
};

}  // namespace truetriad
