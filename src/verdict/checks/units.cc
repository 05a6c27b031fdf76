// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/units.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/messages.h"
#include "data/length_spread.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "truetriad/base/triad.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// Manufacture and mounting change a gain by less than this factor; soft iron rarely exceeds it.
constexpr double kMostGain = 1.3;
// With `units: trust`, there is a warning if a magnetometer's gain is wrong by a larger factor.
constexpr double kOddGain = 5.0;
// Largest ratio of one axis' gain to the gains of the other two. Manufacture and nearly all soft
// iron stay below it.
constexpr double kOddAxis = 1.6;
// Soft iron does not cause a gain of three times the other axes'.
constexpr double kWrongAxis = 3.0;
// Bias and a hand's accelerations make readings at most this factor longer or shorter than gravity.
constexpr double kMostForce = 3.0;
// A unit is recognised if it fits the readings within this factor.
constexpr double kUnitFactor = 1.25;
// The Earth's field at its surface is 22 to 67 uT; in a building it may be half or double that.
constexpr double kWeakestFieldUt = 20.0, kStrongestFieldUt = 70.0;
// A field outside of the limits above is only a warning if it is within this factor of them.
constexpr double kIndoors = 2.0;
// Field strength that is assumed when a unit is guessed; half or double this strength would give
// the same unit.
constexpr double kTypicalFieldUt = 50.0;
// Below the first rate readings cannot follow the turns of a hand; no gyroscope exceeds the second.
constexpr double kSlowestHz = 2.0, kFastestHz = 5e4;
// Nobody turns a unit to several attitudes with a rest in each in a shorter time.
constexpr double kShortestRecordingS = 10.0;
// Nobody holds a unit for ten minutes per attitude, except in a chamber.
constexpr double kEndlessRestS = 600.0;
// Fewer rests may be long by chance.
constexpr std::size_t kManyRests = 6;
// The range of temperatures of electronics, with a margin.
constexpr double kColdestDegc = -100.0, kHottestDegc = 200.0;
// Lengths that scatter by less were normalised: even the best raw sensors scatter a hundred times
// as much by noise, bias and gains.
constexpr double kConstantLength = 1e-4;
// If readings are rounded coarsely, their rounding replaces kConstantLength, but at most this.
constexpr double kRoundedLength = 1e-3;
// Readings turn if the range of each axis is at least this share of their length.
constexpr double kTurnedShare = 0.5;

struct KnownUnit {
  Triad triad;
  double truth_per_raw;
  std::string_view name;
};
constexpr double kDeg = kRadPerDeg;
constexpr auto kKnownUnits = std::to_array<KnownUnit>({
    {Triad::kAccelerometer, 1.0, "m/s^2"},
    {Triad::kAccelerometer, kStandardGravityMps2, "g"},
    {Triad::kAccelerometer, 1e-3 * kStandardGravityMps2, "mg"},
    {Triad::kAccelerometer, 1e-2, "cm/s^2"},
    {Triad::kAccelerometer, 1e-3, "mm/s^2"},
    {Triad::kAccelerometer, kStandardGravityMps2 / 16384.0, "counts of a range of 2 g"},
    {Triad::kAccelerometer, kStandardGravityMps2 / 8192.0, "counts of a range of 4 g"},
    {Triad::kAccelerometer, kStandardGravityMps2 / 4096.0, "counts of a range of 8 g"},
    {Triad::kAccelerometer, kStandardGravityMps2 / 2048.0, "counts of a range of 16 g"},
    {Triad::kMagnetometer, 1.0, "uT"},
    {Triad::kMagnetometer, 1e-3, "nT"},
    {Triad::kMagnetometer, 1e3, "mT"},
    {Triad::kMagnetometer, 1e6, "T"},
    {Triad::kMagnetometer, 1e2, "G"},
    {Triad::kMagnetometer, 1e-1, "mG"},
    {Triad::kGyroscope, 1.0, "rad/s"},
    {Triad::kGyroscope, kDeg, "deg/s"},
    {Triad::kGyroscope, 1e-3, "mrad/s"},
    {Triad::kGyroscope, 1e-3 * kDeg, "mdeg/s"},
    {Triad::kGyroscope, 360.0 * kDeg, "turns/s"},
    {Triad::kGyroscope, kDeg / 131.0, "counts of a range of 250 deg/s"},
    {Triad::kGyroscope, kDeg / 65.5, "counts of a range of 500 deg/s"},
    {Triad::kGyroscope, kDeg / 32.8, "counts of a range of 1000 deg/s"},
    {Triad::kGyroscope, kDeg / 16.4, "counts of a range of 2000 deg/s"},
});

std::string StrengthText(double strength_ut) { return Format("%.4g uT", strength_ut); }

bool IsEarthly(double strength_ut, double margin) {
  return strength_ut >= kWeakestFieldUt / margin && strength_ut <= kStrongestFieldUt * margin;
}

// ": looks like mG labelled uT"; empty without a unit.
std::string Guess(const std::optional<std::string>& unit, const std::string& stated) {
  return unit ? ": looks like " + *unit + " labelled " + stated : "";
}

const char* Remedy() {
  return "check that each column holds what its header says, and state the right unit; "
         "`units: trust` takes it as it is";
}

std::optional<Finding> WhyFieldIsNotAsStated(const CalibrateOptions& options) {
  const Knowledge& field = options.reference.field_ut;
  if (!options.triads[Triad::kMagnetometer].enabled || !field.known()) return std::nullopt;
  if (IsEarthly(*field.value, 1.0)) return std::nullopt;
  std::string guess;
  for (const KnownUnit& unit : kKnownUnits) {
    if (unit.triad != Triad::kMagnetometer || unit.truth_per_raw == 1.0) continue;
    if (IsEarthly(*field.value * unit.truth_per_raw, 1.0)) {
      guess = Guess(std::string(unit.name), "uT");
    }
  }
  return Finding(FindingCode::kWrongUnit,
                 "reference.field.strength_ut is " + StrengthText(*field.value) +
                     Format(", but the Earth's field is %g", kWeakestFieldUt) +
                     Format(" to %g uT", kStrongestFieldUt) + guess,
                 "state it in uT; for a field of coils, or a normalised one, set `units: trust`")
      .About(Triad::kMagnetometer)
      .With("strength", *field.value, "uT");
}

// Whether the rests seem far too long for a hand, which holds a unit still for seconds.
bool AreRestsEndless(const PoseSet& poses) {
  std::vector<double> durations_s;
  for (const StaticPose& pose : poses.poses) durations_s.push_back(pose.duration_s());
  return durations_s.size() >= kManyRests && Median(std::move(durations_s)) > kEndlessRestS;
}

// " (ms labelled s?)": the first unit with a plausible sampling rate and duration of rests and
// turns; "" if there is none.
std::string TimeGuess(double rate_hz, double duration_s) {
  // Range of rates at which inertial sensors are logged.
  constexpr double kLowHz = 5.0, kHighHz = 1e4;
  constexpr std::array<std::string_view, 3> kFinerThanS = {"ms", "us", "ns"};
  double factor = 1.0;
  for (const std::string_view finer : kFinerThanS) {
    factor *= 1e3;
    const std::string name(finer);
    if (rate_hz < kSlowestHz && rate_hz * factor > kLowHz) {
      const bool is_likely =
          rate_hz * factor < kHighHz && duration_s / factor > kShortestRecordingS;
      return is_likely ? " (" + name + " labelled s?)" : "";
    }
    if (rate_hz > kFastestHz && rate_hz / factor < kHighHz) {
      return rate_hz / factor > kLowHz ? " (s labelled " + name + "?)" : "";
    }
  }
  return "";
}

std::optional<Finding> WhyTimesAreNotAsStated(const PoseSet& poses,
                                              const CalibrateOptions& options) {
  const bool follows = !poses.moves.empty() || !poses.turns.empty() || poses.poses.empty() ||
                       options.motion.has_value();
  const bool is_endless = !options.HasThermal() && AreRestsEndless(poses);
  for (const Triad triad : {Triad::kGyroscope, Triad::kAccelerometer, Triad::kMagnetometer}) {
    const StreamSummary* stream = poses.Find(triad);
    if (!options.triads[triad].enabled || stream == nullptr) continue;
    const double rate_hz = stream->rate_hz;
    const bool is_slow = rate_hz < kSlowestHz;
    // The accelerometer detects rests if there is no gyroscope.
    const bool lacks_rests = poses.poses.size() < kManyRests && !options.motion.has_value() &&
                             triad == Triad::kAccelerometer;
    const bool matters = is_slow
                             ? is_endless || lacks_rests || (follows && triad == Triad::kGyroscope)
                             : rate_hz > kFastestHz && follows;
    if (!(rate_hz > 0.0) || !matters) continue;
    const std::string guess = TimeGuess(rate_hz, poses.duration_s);
    const std::string seen = "the " + std::string(TriadName(triad)) +
                             Format(" is read at %.4g Hz over ", rate_hz) +
                             Format("%.4g s, which is too ", poses.duration_s) +
                             (is_slow ? "slow for turns and rests" : "fast for any turn");
    Finding finding =
        is_slow && guess.empty()
            ? Finding(FindingCode::kTooSlow,
                      seen,
                      "log raw readings at 10 Hz or more (PX4: sensor_accel, sensor_gyro and "
                      "sensor_mag "
                      "by sensor comparison in SDLOG_PROFILE; ArduPilot: IMU in LOG_BITMASK); "
                      "`units: trust` takes them as they are")
            : Finding(FindingCode::kWrongUnit,
                      seen + ": the times' unit seems " + (is_slow ? "finer" : "coarser") +
                          " than stated" + guess,
                      "state the unit of the times; `units: trust` takes them as they are");
    return finding.About(triad).With("rate", rate_hz, "Hz");
  }
  return std::nullopt;
}

std::optional<Finding> WhyTemperaturesAreNotAsStated(const PoseSet& poses) {
  if (!poses.temperature_range_degc) return std::nullopt;
  const Eigen::Vector2d& range = *poses.temperature_range_degc;
  // All temperatures must be impossible: a single one may be a disturbance.
  if (range[0] <= kHottestDegc && range[1] >= kColdestDegc) return std::nullopt;
  const bool is_kelvin =
      range[0] + kAbsoluteZeroDegc > kColdestDegc && range[1] + kAbsoluteZeroDegc < kHottestDegc;
  return Finding(
             FindingCode::kWrongUnit,
             Format("the temperature is %.6g", range[0]) + Format(" to %.6g degC: ", range[1]) +
                 (is_kelvin ? "looks like K labelled degC" : "looks like counts labelled degC"),
             "state its unit, or `wrap_bits` if its register overflows, or leave the column out; "
             "`units: trust` takes it as it is")
      .With("lowest", range[0], "degC")
      .With("highest", range[1], "degC");
}

// ", and its y axis spans 9.8 times the range of the others", if an axis does.
std::string OddSpan(const StreamSummary& stream) {
  const Eigen::Vector3d span = stream.maximum_raw - stream.minimum_raw;
  for (int axis = 0; axis < 3; ++axis) {
    const double others = std::max(span[(axis + 1) % 3], span[(axis + 2) % 3]);
    if (!(span[axis] > kMostForce * others) || !(others > 0.0)) continue;
    return std::string(", and its ") + "xyz"[axis] +
           Format(" axis spans %.3g times the range of the others", span[axis] / others);
  }
  return "";
}

// Compares the readings' length with gravity, at rest or over a motion.
std::optional<Finding> WhyForceIsNotAsStated(const PoseSet& poses,
                                             const CalibrateOptions& options) {
  const StreamSummary* stream = poses.Find(Triad::kAccelerometer);
  const TriadOptions& sensor = options.triads[Triad::kAccelerometer];
  if (!sensor.enabled || sensor.fixed_sensitivity || stream == nullptr || stream->unit.is_counts) {
    return std::nullopt;
  }
  std::vector<double> lengths;
  for (const Eigen::Vector3d& reading : ReadingsOf(poses, Triad::kAccelerometer)) {
    lengths.push_back(reading.norm());
  }
  const double length = lengths.empty() ? stream->length_raw : Median(std::move(lengths));
  const double gravity = *options.reference.gravity_mps2.value;
  const double gain = length * stream->unit.truth_per_raw / gravity;
  if (!(gain > 0.0) || (gain < kMostForce && gain > 1.0 / kMostForce)) return std::nullopt;
  return Finding(FindingCode::kWrongUnit,
                 Format("the accelerometer reads %.4g ", length) + stream->unit.name +
                     (options.motion ? " typically" : " at rest") +
                     Format(", %.3g times gravity", gain) + OddSpan(*stream) +
                     Guess(LooksLike(Triad::kAccelerometer, gravity / length, stream->unit),
                           stream->unit.name),
                 Remedy())
      .About(Triad::kAccelerometer)
      .With("gain", gain);
}

// The half of the readings (for a table, of its rows) whose lengths lie closest together.
LengthSpread::Half LengthsOf(const PoseSet& poses, const StreamSummary& stream) {
  if (stream.length_raw > 0.0) {
    return {stream.length_raw, stream.length_scatter, stream.length_extent};
  }
  LengthSpread lengths;
  for (const Eigen::Vector3d& reading : ReadingsOf(poses, stream.triad)) lengths.Add(reading);
  return lengths.ShortestHalf();
}

// Refuses readings that turn and always have the same length.
std::optional<Finding> WhyNotRaw(const PoseSet& poses, Triad triad) {
  if (poses.Find(triad) == nullptr) return std::nullopt;
  const StreamSummary& stream = *poses.Find(triad);
  // Computed poses, as of a plan, have no readings.
  if (stream.minimum_raw == stream.maximum_raw) return std::nullopt;
  const LengthSpread::Half half = LengthsOf(poses, stream);
  if (!(half.length > 0.0) || half.extent.minCoeff() < kTurnedShare) return std::nullopt;
  const double rounding = stream.resolution_raw.maxCoeff() / half.length;
  if (half.scatter > std::clamp(rounding, kConstantLength, kRoundedLength)) return std::nullopt;
  return Finding(FindingCode::kNotRaw,
                 std::string(TriadName(triad)) +
                     Format(": most readings have the same length, %.6g ", half.length) +
                     stream.unit.name + Format(" to within %.1e of it", half.scatter) +
                     ", in all directions: they were normalised, so bias and gains are lost",
                 "record the sensor's raw readings")
      .About(triad)
      .With("length", half.length, stream.unit.name)
      .With("scatter", half.scatter);
}

std::optional<Finding> WhyGainIsOdd(Triad triad,
                                    const Eigen::Matrix3d& sensitivity,
                                    const Unit& unit,
                                    bool is_checked) {
  const double gain = std::cbrt(std::abs(sensitivity.determinant())) * unit.truth_per_raw;
  const double most = is_checked ? kMostGain : kOddGain;
  if (!is_checked && triad != Triad::kMagnetometer) return std::nullopt;
  if (gain < most && gain > 1.0 / most) return std::nullopt;
  const auto guess = LooksLike(triad, unit.truth_per_raw / gain, unit);
  Finding finding(guess && is_checked ? FindingCode::kWrongUnit : FindingCode::kOddGain,
                  "the " + std::string(TriadName(triad)) +
                      Format("'s gain is %.4g times the nominal one of ", gain) + unit.name +
                      (triad == Triad::kMagnetometer ? " at the stated field strength" : "") +
                      Guess(guess, unit.name),
                  triad == Triad::kMagnetometer ? "check the unit and strength_ut" : Remedy());
  if (is_checked) finding.As(Severity::kRefusal);
  return finding.About(triad).With("gain", gain);
}

// Finds a column with another unit, or of another sensor.
std::optional<Finding> WhyAxisIsOdd(Triad triad, const Eigen::Matrix3d& sensitivity) {
  const Eigen::Vector3d gains = sensitivity.rowwise().norm();
  double odd = 1.0;
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    const double others = std::sqrt(gains[(i + 1) % 3] * gains[(i + 2) % 3]);
    if (std::abs(std::log(gains[i] / others)) <= std::abs(std::log(odd))) continue;
    odd = gains[i] / others;
    axis = i;
  }
  const double times = std::max(odd, 1.0 / odd);
  if (times < kOddAxis) return std::nullopt;
  // Iron distorts only the readings of a magnetometer.
  const bool is_wrong = triad != Triad::kMagnetometer || times > kWrongAxis;
  Finding finding(FindingCode::kOddGain,
                  "the " + std::string(TriadName(triad)) + "'s " + "xyz"[axis] +
                      Format(" axis has %.3g times the gain of the other two", odd),
                  is_wrong
                      ? "check that its column has the unit of the others; `units: trust` takes "
                        "it as it is"
                      : "check that its column has the unit of the others, and look for "
                        "iron on the device");
  if (is_wrong) finding.As(Severity::kRefusal);
  return finding.About(triad).With("gain", odd);
}

}  // namespace

std::vector<double> KnownUnitsOf(Triad triad) {
  std::vector<double> units;
  for (const KnownUnit& unit : kKnownUnits) {
    if (unit.triad == triad) units.push_back(unit.truth_per_raw);
  }
  return units;
}

std::optional<std::string> LooksLike(Triad triad, double truth_per_raw, const Unit& stated) {
  const KnownUnit* nearest = nullptr;
  double least = std::log(kUnitFactor);
  for (const KnownUnit& unit : kKnownUnits) {
    const double off = std::abs(std::log(truth_per_raw / unit.truth_per_raw));
    if (unit.triad != triad || off >= least) continue;
    nearest = &unit;
    least = off;
  }
  if (nearest == nullptr || nearest->truth_per_raw == stated.truth_per_raw) return std::nullopt;
  return std::string(nearest->name);
}

std::optional<Finding> WhyNotAsStated(const PoseSet& poses, const CalibrateOptions& options) {
  for (const Triad triad : {Triad::kMagnetometer, Triad::kAccelerometer}) {
    if (!options.triads[triad].enabled || options.sweep) continue;
    if (auto why = WhyNotRaw(poses, triad); why && Acts(Mechanism::kNormalised)) return why;
  }
  if (!options.check_units) return std::nullopt;
  const auto acts = [](const std::optional<Finding>& why, Mechanism mechanism) {
    return why && Acts(mechanism);
  };
  auto why = WhyTemperaturesAreNotAsStated(poses);
  if (acts(why, Mechanism::kUnitOfTemperature)) return why;
  if (options.sweep) return std::nullopt;
  why = WhyForceIsNotAsStated(poses, options);
  if (acts(why, Mechanism::kUnitOfForce)) return why;
  why = WhyFieldIsNotAsStated(options);
  if (acts(why, Mechanism::kUnitOfField)) return why;
  why = WhyTimesAreNotAsStated(poses, options);
  if (acts(why, Mechanism::kUnitOfTimes)) return why;
  return WhyTurnsAreNotAsStated(poses, options);
}

Findings CheckGains(const PoseSet& poses,
                    const CalibrateOptions& options,
                    const PerTriad<Eigen::Matrix3d>& sensitivity,
                    const ReferenceValues& reference) {
  Findings findings;
  for (const Triad triad : kTriads) {
    const StreamSummary* stream = poses.Find(triad);
    const TriadOptions& sensor = options.triads[triad];
    if (!sensor.enabled || stream == nullptr || stream->unit.is_counts) continue;
    if (sensor.fixed_sensitivity) continue;
    if (options.check_units) {
      if (auto odd = WhyAxisIsOdd(triad, sensitivity[triad])) {
        findings.push_back(*std::move(odd));
        continue;
      }
    }
    if (triad == Triad::kMagnetometer && reference.field_nominal) {
      const double strength = *reference.field_ut;
      if (!options.check_units || IsEarthly(strength, 1.0)) continue;
      const double truth_per_raw = stream->unit.truth_per_raw * kTypicalFieldUt / strength;
      findings.push_back(
          Finding(
              IsEarthly(strength, kIndoors) ? FindingCode::kFieldUnlikely : FindingCode::kWrongUnit,
              "the magnetometer sees a field of " + StrengthText(strength) +
                  ", but the Earth's is 20 to 70 uT" +
                  Guess(LooksLike(triad, truth_per_raw, stream->unit), stream->unit.name),
              Remedy())
              .About(triad)
              .With("strength", strength, "uT"));
      continue;
    }
    if (auto odd = WhyGainIsOdd(triad, sensitivity[triad], stream->unit, options.check_units)) {
      findings.push_back(*std::move(odd));
    }
  }
  return findings;
}

Findings CheckGains(const SettledRun& run, const SolvedRun& solved) {
  PerTriad<Eigen::Matrix3d> sensitivity;
  for (const Triad triad : kTriads) {
    if (run.options.triads[triad].enabled) sensitivity[triad] = run.graph.sensitivity(triad);
  }
  return CheckGains(run.poses, run.options, sensitivity, solved.stated.reference);
}

}  // namespace truetriad
