// SPDX-License-Identifier: Apache-2.0
#include "config/scenario_motion.h"

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "config/documents.h"
#include "config/quantities.h"
#include "config/yaml_values.h"
#include "io/pose_program_file.h"
#include "model/attitude_sets.h"

namespace truetriad {
namespace {

/// More poses than anybody takes; a guard against a slip of the keyboard.
constexpr int kMaxPoses = 100000;
constexpr int kAnyRest = std::numeric_limits<int>::max();

constexpr NamedValues<Triad, 3> kTriadNames = {{
    {Triad::kAccelerometer, TriadName(Triad::kAccelerometer)},
    {Triad::kGyroscope, TriadName(Triad::kGyroscope)},
    {Triad::kMagnetometer, TriadName(Triad::kMagnetometer)},
}};

bool ReadCount(YamlReader reader, int highest, int* value) {
  int number = 0;
  if (!reader.Read(&number)) return false;
  if (number < 1 || number > highest) {
    reader.Fail("`" + std::to_string(number) +
                "` is out of range; expected a whole number from 1 to " + std::to_string(highest));
    return false;
  }
  *value = number;
  return true;
}

QuantityKeys TemperatureRateKeys(std::string_view stem) {
  const std::string key(stem);
  return {{key + "_degcps", 1.0}, {key + "_degc_min", 1.0 / 60.0}, {key + "_degc_h", 1.0 / 3600.0}};
}

std::vector<ProgramPose> PosesOf(const std::vector<Eigen::Quaterniond>& attitudes) {
  std::vector<ProgramPose> poses;
  poses.reserve(attitudes.size());
  for (const Eigen::Quaterniond& attitude : attitudes) {
    poses.push_back({attitude, std::nullopt, AttitudeInWords(attitude)});
  }
  return poses;
}

std::vector<ProgramPose> ReadAttitudeSet(YamlReader reader, const std::string& file) {
  if (!reader) return {};
  if (IsWord(reader, "six_face")) return PosesOf(SixFaceAttitudes());
  if (IsWord(reader, "cube")) return PosesOf(CubeAttitudes());
  int count = 0;
  std::string program_file;
  YamlReader program = reader.Child("file");
  const bool has_file = program.Read(&program_file);
  const bool has_count = ReadCount(reader.Child("spread"), kMaxPoses, &count);
  if (reader.IsMap()) reader.RejectUnknown();
  if (has_count && !has_file) return PosesOf(SpreadAttitudes(count));
  if (has_file && !has_count) {
    Result<PoseProgram> read = ReadPoseProgram(Resolve(program_file, file));
    if (read) return std::move(read->poses);
    program.Fail(read.error().message);
    return {};
  }
  reader.Fail("expected one of six_face, cube, { spread: N }, { file: program.yaml }");
  return {};
}

PosesStep ReadPoses(YamlReader reader, const std::string& file) {
  PosesStep step;
  step.poses = ReadAttitudeSet(reader.RequireChild("attitudes"), file);
  int rounds = 1;
  if (YamlReader child = reader.Child("rounds"); ReadCount(child, kMaxPoses, &rounds)) {
    const std::vector<ProgramPose> once = step.poses;
    if (once.size() * static_cast<std::size_t>(rounds) > kMaxPoses) {
      child.Fail(std::to_string(rounds) + " rounds of " + std::to_string(once.size()) +
                 " poses are too many; expected at most " + std::to_string(kMaxPoses) +
                 " poses in all");
      rounds = 1;
    }
    for (int i = 1; i < rounds; ++i) {
      step.poses.insert(step.poses.end(), once.begin(), once.end());
    }
  }
  ReadNumber(reader.Child("rest_s"), kPositive, &step.rest_s);
  ReadNumber(reader.Child("rest_spread"), {0.0, 0.9, "a share from 0 to 0.9"}, &step.rest_spread);
  ReadNumber(reader.Child("move_s"), kPositive, &step.move_s);
  ReadQuantity(reader, AngleKeys("tilt_sigma"), kNotNegative, &step.tilt_sigma_rad);
  ReadNumber(reader.Child("travel_m"), kNotNegative, &step.travel_m);
  reader.Optional("shuffle", &step.shuffle);
  reader.RejectUnknown();
  return step;
}

/// x, y, z, their opposites, or [a, b, c].
void ReadAxis(YamlReader reader, Eigen::Vector3d* axis) {
  if (!reader) return;
  if (reader.IsScalar()) {
    std::string word;
    reader.Read(&word);
    const bool is_negative = word.starts_with('-');
    const std::size_t letter = kAxisLetters.find(word.substr(is_negative ? 1 : 0));
    if (word.size() == (is_negative ? 2U : 1U) && letter != std::string_view::npos) {
      *axis = (is_negative ? -1.0 : 1.0) * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(letter));
      return;
    }
  } else if (Eigen::Vector3d value; reader.IsSequence() && reader.Read(&value)) {
    if (!value.isZero(0.0)) {
      *axis = value;
      return;
    }
  }
  reader.Fail("expected a body axis: x, y, z, -x, -y, -z or [a, b, c]");
}

TurnStep ReadTurn(YamlReader reader) {
  TurnStep step;
  ReadAxis(reader.RequireChild("axis"), &step.axis_in_body);
  if (YamlReader turns = reader.Child("turns"); turns.Read(&step.turns) && step.turns == 0.0) {
    turns.Fail("expected a number other than zero");
  }
  ReadNumber(reader.Child("duration_s"), kPositive, &step.duration_s);
  ReadNumber(reader.Child("rest_s"), kNotNegative, &step.rest_s);
  reader.RejectUnknown();
  return step;
}

RateStep ReadTurntable(YamlReader reader) {
  RateStep step;
  ReadAxis(reader.RequireChild("axis"), &step.axis_in_body);
  std::string_view rates_key;
  for (const auto& [key, scale] : RateKeys("rates")) {
    YamlReader child = reader.Child(key);
    std::vector<double> rates;
    if (!child.Read(&rates)) continue;
    if (!rates_key.empty()) child.Fail("says the same as `" + std::string(rates_key) + "`");
    rates_key = key.ends_with("radps") ? "rates_radps" : "rates_degps";
    if (rates.empty()) child.Fail("has no rates; list at least one");
    for (const double rate : rates) {
      if (rate == 0.0)
        child.Fail("a rate of zero is not a turn; the rests between rates are added automatically");
      step.rates_radps.push_back(scale * rate);
    }
  }
  if (rates_key.empty()) reader.Fail("expected `rates_degps` or `rates_radps`");
  ReadNumber(reader.Child("hold_s"), kPositive, &step.hold_s);
  ReadNumber(reader.Child("ramp_s"), kPositive, &step.ramp_s);
  ReadNumber(reader.Child("rest_s"), kNotNegative, &step.rest_s);
  reader.RejectUnknown();
  return step;
}

TumbleStep ReadTumble(YamlReader reader) {
  TumbleStep step;
  ReadNumber(reader.Child("duration_s"), kPositive, &step.duration_s);
  ReadQuantity(reader, RateKeys("rms_rate"), kPositive, &step.rms_rate_radps);
  ReadNumber(reader.Child("hand_acceleration_mps2"), kNotNegative, &step.hand_acceleration_mps2);
  reader.RejectUnknown();
  return step;
}

/// The one key of a list's item that says what it is.
template <std::size_t N>
std::optional<YamlReader> ReadKind(YamlReader item, const std::array<std::string_view, N>& kinds) {
  std::optional<YamlReader> found;
  int count = 0;
  std::string known;
  for (const std::string_view kind : kinds) {
    known += (known.empty() ? "" : ", ") + std::string(kind);
    if (YamlReader child = item.Child(kind)) {
      // Not assigned: assigning a YAML node changes the document.
      found.emplace(child);
      ++count;
    }
  }
  item.RejectUnknown();
  if (item.IsMap() && count != 1) item.Fail("expected one of " + known);
  return count == 1 ? found : std::nullopt;
}

bool Is(const YamlReader& reader, std::string_view kind) {
  return reader.name().ends_with("." + std::string(kind));
}

std::optional<TemperatureSegment> ReadSegment(const YamlReader& item) {
  constexpr std::array<std::string_view, 3> kKinds = {"hold", "ramp", "sine"};
  std::optional<YamlReader> reader = ReadKind(item, kKinds);
  if (!reader) return std::nullopt;
  std::optional<TemperatureSegment> segment;
  if (Is(*reader, "hold")) {
    TemperatureHold hold;
    ReadNumber(reader->RequireChild("duration_s"), kPositive, &hold.duration_s);
    segment = hold;
  } else if (Is(*reader, "ramp")) {
    TemperatureRamp ramp;
    ReadNumber(reader->RequireChild("to_degc"), kTemperatureDegc, &ramp.to_degc);
    ReadQuantity(*reader, TemperatureRateKeys("rate"), kPositive, &ramp.rate_degcps);
    segment = ramp;
  } else {
    TemperatureSine sine;
    ReadNumber(reader->RequireChild("amplitude_degc"), kAnyNumber, &sine.amplitude_degc);
    ReadNumber(reader->RequireChild("period_s"), kPositive, &sine.period_s);
    ReadNumber(reader->RequireChild("duration_s"), kPositive, &sine.duration_s);
    segment = sine;
  }
  reader->RejectUnknown();
  return segment;
}

DisturbanceTime ReadWhen(YamlReader& reader) {
  DisturbanceTime when;
  int rest = 1;
  if (YamlReader child = reader.Child("rest")) {
    ReadCount(std::move(child), kAnyRest, &rest);
    when.rest = rest;
  }
  ReadNumber(reader.Child("offset_s"), kNotNegative, &when.offset_s);
  return when;
}

/// A change of the field that stays.
template <typename Step>
Step ReadStep(YamlReader& reader, const std::string& frame) {
  Step step{.when = ReadWhen(reader)};
  if (!ReadQuantity(
          reader, TriadKeys("change", Triad::kMagnetometer), kAnyNumber, &step.change_ut)) {
    reader.Fail("expected `change_ut`: [x, y, z] in the " + frame + " frame");
  }
  return step;
}

std::optional<Disturbance> ReadDisturbance(const YamlReader& item) {
  constexpr std::array<std::string_view, 6> kKinds = {
      "knock", "magnet", "hard_iron_step", "field_step", "stuck", "unsettled"};
  std::optional<YamlReader> reader = ReadKind(item, kKinds);
  if (!reader) return std::nullopt;
  std::optional<Disturbance> disturbance;
  if (Is(*reader, "knock")) {
    Knock knock{.when = ReadWhen(*reader)};
    ReadNumber(reader->Child("duration_s"), kPositive, &knock.duration_s);
    const QuantityKeys keys = TriadKeys("peak", Triad::kAccelerometer);
    if (!ReadQuantity(*reader, keys, kAnyNumber, &knock.peak_mps2)) {
      reader->Fail("expected `peak_mps2` or `peak_g`: [x, y, z] in the body frame");
    }
    disturbance = knock;
  } else if (Is(*reader, "magnet")) {
    MagnetPassing magnet{.when = ReadWhen(*reader)};
    ReadNumber(reader->Child("duration_s"), kPositive, &magnet.duration_s);
    const QuantityKeys keys = TriadKeys("peak", Triad::kMagnetometer);
    if (!ReadQuantity(*reader, keys, kAnyNumber, &magnet.peak_ut)) {
      reader->Fail("expected `peak_ut`: [x, y, z] in the world frame");
    }
    disturbance = magnet;
  } else if (Is(*reader, "hard_iron_step")) {
    disturbance = ReadStep<HardIronStep>(*reader, "body");
  } else if (Is(*reader, "field_step")) {
    disturbance = ReadStep<FieldStep>(*reader, "world");
  } else if (Is(*reader, "stuck")) {
    StuckSamples stuck{.when = ReadWhen(*reader)};
    ReadChoice(reader->RequireChild("sensor"), kTriadNames, &stuck.triad);
    ReadNumber(reader->Child("duration_s"), kPositive, &stuck.duration_s);
    disturbance = stuck;
  } else {
    UnsettledPose pose;
    ReadCount(reader->RequireChild("rest"), kAnyRest, &pose.rest);
    if (!ReadQuantity(*reader, AngleKeys("tilt"), kAnyNumber, &pose.tilt_rad)) {
      reader->Fail("expected `tilt_deg`: [x, y, z] in the body frame");
    }
    ReadNumber(reader->Child("decay_s"), kPositive, &pose.decay_s);
    disturbance = pose;
  }
  reader->RejectUnknown();
  return disturbance;
}

}  // namespace

void ReadMotion(YamlReader reader, const std::string& file, std::vector<MotionStep>* motion) {
  if (!reader) return;
  constexpr std::array<std::string_view, 4> kKinds = {"poses", "turn", "turntable", "tumble"};
  motion->clear();
  const std::vector<YamlReader> items = reader.Items();
  if (reader.IsSequence() && items.empty()) reader.Fail("has no steps; list at least one");
  for (const YamlReader& item : items) {
    const std::optional<YamlReader> step = ReadKind(item, kKinds);
    if (!step) continue;
    if (Is(*step, "poses")) {
      motion->emplace_back(ReadPoses(*step, file));
    } else if (Is(*step, "turn")) {
      motion->emplace_back(ReadTurn(*step));
    } else if (Is(*step, "turntable")) {
      motion->emplace_back(ReadTurntable(*step));
    } else {
      motion->emplace_back(ReadTumble(*step));
    }
  }
}

void ReadTemperature(YamlReader reader, SimulatedTemperature* temperature) {
  if (!reader) return;
  ReadNumber(reader.Child("start_degc"), kTemperatureDegc, &temperature->start_degc);
  if (YamlReader profile = reader.Child("profile")) {
    temperature->profile.clear();
    for (const YamlReader& item : profile.Items()) {
      if (const std::optional<TemperatureSegment> segment = ReadSegment(item)) {
        temperature->profile.push_back(*segment);
      }
    }
  }
  if (YamlReader soak = reader.Child("soak_degc"); soak && soak.Read(&temperature->soak_degc)) {
    for (YamlReader& item : soak.Items()) {
      double value = 0.0;
      ReadNumber(item, kTemperatureDegc, &value);
    }
  }
  ReadQuantity(
      reader, TemperatureRateKeys("chamber_rate"), kPositive, &temperature->chamber_rate_degcps);
  for (const auto& [key, value] :
       {std::pair("settle_s", &temperature->settle_s),
        std::pair("element_lag_s", &temperature->element_lag_s),
        std::pair("thermometer_lag_s", &temperature->thermometer_lag_s),
        std::pair("thermometer_noise_degc", &temperature->thermometer_noise_degc),
        std::pair("thermometer_resolution_degc", &temperature->thermometer_resolution_degc),
        std::pair("hysteresis_degc", &temperature->hysteresis_degc),
        std::pair("ambient_lag_s", &temperature->ambient_lag_s),
        std::pair("ambient_noise_degc", &temperature->ambient_noise_degc),
        std::pair("ambient_resolution_degc", &temperature->ambient_resolution_degc),
        std::pair("element_ambient_share", &temperature->element_ambient_share)}) {
    ReadNumber(reader.Child(key), kNotNegative, value);
  }
  reader.Optional("logged", &temperature->logged);
  reader.Optional("ambient_logged", &temperature->ambient_logged);
  reader.RejectUnknown();
}

void ReadDisturbances(YamlReader reader, std::vector<Disturbance>* disturbances) {
  if (!reader) return;
  disturbances->clear();
  for (const YamlReader& item : reader.Items()) {
    if (const std::optional<Disturbance> disturbance = ReadDisturbance(item)) {
      disturbances->push_back(*disturbance);
    }
  }
}

}  // namespace truetriad
