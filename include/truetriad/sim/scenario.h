// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/io/recording.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// How units of one kind differ from the nominal unit, as standard deviations. Each entry is drawn
/// independently from a normal distribution. All zero: every unit equals the nominal one.
struct UnitSpread {
  double bias = 0.0;              ///< Each axis, true unit.
  double scale = 0.0;             ///< Each gain, relative: 0.01 = 1 %.
  double misalignment_rad = 0.0;  ///< Each off-diagonal entry of K^-1 S, K = diag S.
  double g_sensitivity = 0.0;     ///< Each entry, true unit per m/s^2. Gyroscope only.
  double thermal_bias = 0.0;      ///< Each axis of the linear term of the bias, true unit / degC.
  double thermal_scale = 0.0;     ///< Each gain of the linear term of S, relative / degC.
  double turn_on_bias = 0.0;      ///< Each axis, true unit; drawn for each session of the unit.
  /// Each axis, (true unit)^-power of the term; only terms that this kind of sensor may have.
  PerAxisTerm<double> axis_terms = {};
};

/// Noise of one triad, per axis, stated as if it were added to the true quantity: in the readings
/// it is multiplied by the nominal gain |diag S|. All zero: no noise. Range of every number: >= 0.
struct SensorNoise {
  /// White noise N, true unit / sqrt(Hz): one sample's sigma is N sqrt(rate), and N is the Allan
  /// deviation at 1 s (IEEE Std 952-1997, C.1.1: angle or velocity random walk).
  Eigen::Vector3d density = Eigen::Vector3d::Zero();

  /// Bias instability as a first-order Gauss-Markov process, stationary from the first sample on:
  /// sigma, true unit, and correlation time. Its Allan deviation peaks at 0.617 sigma, at 1.89
  /// correlation times.
  Eigen::Vector3d instability_sigma = Eigen::Vector3d::Zero();
  double correlation_time_s = 100.0;  ///< Range: > 0.

  /// Random walk K of the bias, true unit / s / sqrt(Hz): zero at the start, sigma K sqrt(t) later
  /// (IEEE Std 952-1997, C.1.4).
  Eigen::Vector3d random_walk = Eigen::Vector3d::Zero();
};

/// The sampling of a triad, and the errors of the times in its log.
struct SensorSampling {
  double rate_hz = 100.0;  ///< Range: > 0, <= 1e6.
  double jitter_s = 0.0;   ///< Sigma of the error of a reported time. Range: 0…0.2 / rate.
  double dropout = 0.0;    ///< Probability that a sample is missing. Range: 0…1, less than 1.
  double clock_offset_s = 0.0;  ///< Reported minus true time. Range: -1e6…1e6.
};

/// What the gyroscope reports.
enum class GyroscopeOutput {
  /// The mean rate since the last sample (for the first sample, over one interval): Log(R'(t1)^T
  /// R'(t2)) / (t2 - t1). R' is the attitude against the stars, so that integrating the readings
  /// restores the attitudes to the last digit. If a sample drops out, its part of the turn is lost.
  /// Range: less than half a turn from sample to sample.
  kMeanRate,
  kInstantaneous,  ///< The rate at the moment of the sample.
};

/// One triad of the simulated units.
struct SimulatedTriad {
  Unit unit;                           ///< Unit of the readings.
  std::optional<double> si_per_count;  ///< Stated in the recording; only for readings in counts.

  /// Bias in raw, sensitivity in raw per true unit. Axis terms are only those that this kind of
  /// sensor may have.
  TriadModel<double> nominal;
  std::optional<Eigen::Matrix3d> g_sensitivity;  ///< Raw per m/s^2. Gyroscope only.
  /// Terms in the element's temperature, which is not clamped to `range_degc`.
  std::optional<ThermalTerms> thermal;
  UnitSpread spread;

  SensorNoise noise;
  SensorSampling sampling;
  double resolution_raw = 0.0;  ///< Readings are rounded to its multiples; 0: not rounded.
  std::optional<Eigen::Vector2d> range_raw;  ///< Readings stop at its ends, low and high.

  /// Position of the sensor relative to the point about which the unit turns, body frame.
  /// Accelerometer only: f = R^T (a + g) + alpha x r + omega x (omega x r).
  Eigen::Vector3d lever_arm_m = Eigen::Vector3d::Zero();
  GyroscopeOutput gyroscope_output = GyroscopeOutput::kMeanRate;
};

/// What surrounds the unit. World x points to magnetic north, so that the field's heading is zero.
struct SimulatedWorld {
  struct EarthRate {
    double latitude_rad = 0.0;     ///< North positive.
    double declination_rad = 0.0;  ///< Positive if magnetic north is east of true north.
  };
  double gravity_mps2 = kStandardGravityMps2;  ///< Range: 1.5…30.
  double field_ut = 48.0;                      ///< Range: 0, or 1…1000.
  double dip_rad = 1.0821041362364843;  ///< Positive where the field points down. Default: 62 deg.
  std::optional<EarthRate> earth_rate;  ///< Unset: the earth stands still.
};

/// Rests in given attitudes, with a smooth turn about a fixed axis into each (minimum jerk).
struct PosesStep {
  std::vector<ProgramPose> poses;
  double rest_s = 4.0;       ///< Range: > 0.
  double rest_spread = 0.0;  ///< Rests last rest_s (1 ± this), uniform. Range: 0…0.9.
  double move_s = 1.2;       ///< Range: > 0.
  /// Sigma, about each body axis, of the error with which each pose is taken.
  double tilt_sigma_rad = 0.0;
  double travel_m = 0.0;  ///< Distance by which each move carries the unit, in a random direction.
  bool shuffle = false;   ///< Take the poses in a random order.
};

/// A turn about a body axis by any number of revolutions, then a rest (Ferraris-style).
struct TurnStep {
  Eigen::Vector3d axis_in_body = Eigen::Vector3d::UnitZ();  ///< Any length but zero.
  double turns = 1.0;                                       ///< Number of turns, signed.
  double duration_s = 4.0;                                  ///< Range: > 0.
  double rest_s = 2.0;                                      ///< Range: >= 0.
};

/// A turntable about a body axis: for each rate a ramp up, a hold, a ramp down and a rest.
struct RateStep {
  Eigen::Vector3d axis_in_body = Eigen::Vector3d::UnitZ();  ///< Any length but zero.
  std::vector<double> rates_radps;                          ///< Signed, none zero.
  double hold_s = 5.0;                                      ///< Range: > 0.
  double ramp_s = 1.0;                                      ///< Range: > 0.
  double rest_s = 2.0;                                      ///< Range: >= 0.
};

/// Continuous turning through all attitudes, no two alike, from rest to rest.
struct TumbleStep {
  double duration_s = 60.0;     ///< Range: > 0.
  double rms_rate_radps = 2.0;  ///< RMS length of the rate at full speed. Range: > 0.
  /// RMS of the acceleration that the hand adds along each world axis, at frequencies from some
  /// tenths of a hertz to 2 Hz. Range: >= 0.
  double hand_acceleration_mps2 = 0.0;
};

/// Chosen: 16 sessions, which give the σ of a turn-on bias to 18 %, 1 / sqrt(2 * 15).
inline constexpr int kMostSimulatedSessions = 16;

using MotionStep = std::variant<PosesStep, TurnStep, RateStep, TumbleStep>;

/// One segment of the chamber's temperature.
struct TemperatureHold {
  double duration_s = 0.0;  ///< Range: > 0.
};
struct TemperatureRamp {
  double to_degc = 25.0;
  double rate_degcps = 0.01;  ///< Absolute; the sign follows from start and end. Range: > 0.
};
struct TemperatureSine {
  double amplitude_degc = 0.0;  ///< About the temperature at the sine's start; rises first.
  double period_s = 3600.0;     ///< Range: > 0.
  double duration_s = 3600.0;   ///< Range: > 0.
};
using TemperatureSegment = std::variant<TemperatureHold, TemperatureRamp, TemperatureSine>;

/// The chamber, and how the unit and its thermometer follow it.
struct SimulatedTemperature {
  double start_degc = 25.0;  ///< Everything has this temperature at the start.
  /// The chamber's temperature from the start of the recording on, held at its last value
  /// afterwards. The motion alone sets the length of the recording. Not together with `soak_degc`.
  std::vector<TemperatureSegment> profile;
  /// Soak temperatures. The motion is repeated at each of them, and the unit rests while the
  /// chamber changes its temperature.
  std::vector<double> soak_degc;
  /// How fast the chamber changes to a soak temperature or to the temperature of a pose, and how
  /// long the unit then waits before the next move.
  double chamber_rate_degcps = 0.05;  ///< Range: > 0.
  double settle_s = 60.0;             ///< Range: >= 0.

  double element_lag_s = 0.0;           ///< First-order lag from chamber to elements.
  double thermometer_lag_s = 0.0;       ///< First-order lag from chamber to the unit's thermometer.
  double thermometer_noise_degc = 0.0;  ///< Sigma of one reading.
  double thermometer_resolution_degc = 0.0;  ///< 0: not rounded.
  /// Half-width of the play between the element's temperature and the temperature on which bias and
  /// matrix depend: the second one does not follow the first until the play is used up.
  double hysteresis_degc = 0.0;
  bool logged = true;  ///< The recording has a temperature column.

  bool ambient_logged = false;           ///< The recording has a column of the ambient temperature.
  double ambient_lag_s = 0.0;            ///< First-order lag from chamber to ambient thermometer.
  double ambient_noise_degc = 0.0;       ///< Sigma of one reading.
  double ambient_resolution_degc = 0.0;  ///< 0: not rounded.
  /// The elements' temperature is (1 - share) times the unit's plus share times the ambient
  /// thermometer's, as if heat flowed through the package. Range: 0 to 1.
  double element_ambient_share = 0.0;
};

/// When a disturbance begins.
struct DisturbanceTime {
  std::optional<int> rest;  ///< 1-based number of a rest; unset: the start of the recording.
  double offset_s = 0.0;    ///< Seconds after the start of this rest or of the recording. Range: >=
                            ///< 0.
};

/// A knock: a half-sine pulse of specific force.
struct Knock {
  DisturbanceTime when;
  double duration_s = 0.05;                             ///< Range: > 0.
  Eigen::Vector3d peak_mps2 = Eigen::Vector3d::Zero();  ///< Body frame.
};

/// A magnet (or a lorry) that passes: the field swells and fades as sin^2.
struct MagnetPassing {
  DisturbanceTime when;
  double duration_s = 2.0;                            ///< Range: > 0.
  Eigen::Vector3d peak_ut = Eigen::Vector3d::Zero();  ///< World frame.
};

/// Iron or a magnet on the unit comes loose: from then on, its field in the body is different.
struct HardIronStep {
  DisturbanceTime when;
  Eigen::Vector3d change_ut = Eigen::Vector3d::Zero();  ///< Body frame.
};

/// The unit, or iron near it, is moved to another place: from then on, the field around the unit is
/// different.
struct FieldStep {
  DisturbanceTime when;
  Eigen::Vector3d change_ut = Eigen::Vector3d::Zero();  ///< World frame.
};

/// A triad that repeats its last reading.
struct StuckSamples {
  Triad triad = Triad::kAccelerometer;
  DisturbanceTime when;
  double duration_s = 0.1;  ///< Range: > 0.
};

/// A rest that begins with motion: the unit arrives tilted and creeps into place,
/// tilt (1 + s) e^-s, s = t / decay_s.
struct UnsettledPose {
  int rest = 1;                                        ///< 1-based number of a rest.
  Eigen::Vector3d tilt_rad = Eigen::Vector3d::Zero();  ///< Rotation vector, body frame.
  double decay_s = 0.5;                                ///< Range: > 0.
};

using Disturbance =
    std::variant<Knock, MagnetPassing, HardIronStep, FieldStep, StuckSamples, UnsettledPose>;

/// Everything that determines a simulated recording, or those of a fleet.
struct Scenario {
  std::string description;     ///< One line, which recordings begin with; empty: none.
  std::string serial = "SIM";  ///< Serial number; with `count` > 1 followed by 0001, 0002, …
  std::string model = "simulated";
  std::uint64_t seed = 1;
  int count = 1;  ///< Number of units. Range: 1…9999.
  /// Recordings of each unit, which is switched off in between. Range: 1…kMostSimulatedSessions.
  int sessions = 1;

  PerTriad<std::optional<SimulatedTriad>> sensors;  ///< At least one.
  SimulatedWorld world;
  /// The steps in their order, at least one. The unit starts at rest: in the first pose if
  /// PosesStep comes first, else with its axes along those of the world.
  std::vector<MotionStep> motion;
  double first_rest_s = 2.0;  ///< Rest before the first step when that is not PosesStep.
  SimulatedTemperature temperature;
  std::vector<Disturbance> disturbances;

  /// Every value that is out of its range, and every contradiction between values. Each error
  /// states what was seen, what is expected, and the key of the scenario's file.
  std::vector<Error> Mistakes() const;
  /// Error (bad input): all mistakes, a line each.
  Status Validate() const;
};

/// One triad of one unit as it really is.
struct TrueTriad {
  TriadModel<double> model;
  std::optional<Eigen::Matrix3d> g_sensitivity;
  std::optional<ThermalTerms> thermal;
};

/// One unit drawn from the population of a scenario.
struct SimulatedUnit {
  std::string serial;
  PerTriad<std::optional<TrueTriad>> triads;
};

/// Unit `index` (0-based, below `count`) of a valid scenario. Depends on the seed and the index
/// alone: units can be drawn in any order.
SimulatedUnit DrawUnit(const Scenario& scenario, int index);

/// The scenario of one session (0-based) of unit `index`: that unit alone, with the bias that it
/// has after it was switched on, and random numbers of the session's own. The first session of unit
/// 0 differs only in its bias from the same scenario without sessions.
Scenario SessionOf(const Scenario& scenario, int index, int session);

/// The truth of unit `index` in the schema of a calibration, to be compared with what is estimated
/// from its recording: outcome kConverged, every sigma zero; the covariance lists all parameters of
/// the unit, including temperature terms and g-sensitivity. Gauge `accel-x` if the leading triad's
/// matrix has that form, else `fixture`: the body frame is that of the scenario's attitudes. The
/// reference temperature is that of the thermal terms if there are any, else the scenario's start.
Calibration TruthOf(const Scenario& scenario, int index);

class Simulation;
/// Like TruthOf above, but with the mean biases over a recording, which must have been read to its
/// end.
Calibration TruthOf(const Scenario& scenario, int index, const Simulation& simulation);

/// One rest of the recording, as it really is.
struct TrueRest {
  int number = 0;        ///< 1-based.
  double start_s = 0.0;  ///< True time.
  double end_s = 0.0;
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< At its end.
  /// The attitude that the program asked for, without the error with which the pose was taken.
  Eigen::Quaterniond intended_world_from_body = Eigen::Quaterniond::Identity();
  double element_degc = 25.0;  ///< Temperature of the sensing elements, mean of start and end.
  std::string label;           ///< Label of the pose, or empty.
};

/// The recording of one unit, generated while it is read, in bounded memory. The readings equal
/// those in the file that WriteRecording writes, to the bit.
class Simulation : public SampleSource {
 public:
  /// Error (bad input): the scenario is not valid.
  static Result<std::unique_ptr<Simulation>> Create(const Scenario& scenario, int index);

  /// Every rest between moves that is longer than zero.
  virtual const std::vector<TrueRest>& rests() const = 0;

  /// Rows of each rest, as `poses.yaml` states them. They count rows of the accelerometer's file;
  /// without an accelerometer, of the magnetometer's file or, without both, of the gyroscope's. The
  /// first sampling interval is left out, since a gyroscope averages part of the move over it.
  /// Complete once everything has been read. Rests shorter than a sampling interval are missing.
  virtual std::vector<PoseRange> rest_rows() const = 0;

  /// What the operator of a table would state of the scenario's `turn` and `turntable` steps, with
  /// rows as for rests. A turn includes a reading at rest before and after it; a rate covers its
  /// hold. Complete once everything has been read.
  virtual std::vector<StatedTurn> turns() const = 0;
  virtual std::vector<StatedRate> rates() const = 0;

  /// What bias instability and random walk added to a triad's bias, raw: the mean over the rests,
  /// each of which counts once. If the unit tumbles, it is the mean over the recording. Complete
  /// once everything has been read.
  virtual Eigen::Vector3d mean_wander(Triad triad) const = 0;

  /// The attitude at a true time. Before the start and after the end it is that of the start or the
  /// end.
  virtual Eigen::Quaterniond WorldFromBody(double time_s) const = 0;

  /// Length of the recording.
  virtual double duration_s() const = 0;

  /// How WriteRecording is to write the recording.
  virtual const RecordingFormat& format() const = 0;
};

}  // namespace truetriad
