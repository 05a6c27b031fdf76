// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "config/documents.h"
#include "config/scenario_fields.h"
#include "io/pose_program_file.h"
#include "model/attitude_sets.h"

namespace truetriad {
namespace {

/// No procedure has nearly as many poses; the limit catches mistyped numbers.
constexpr int kMaxPoses = 100000;
constexpr Range kRounds{1, kMaxPoses, "a whole number from 1 to 100000"};
constexpr Range kRest{.lowest = 1, .expected = "a whole number from 1 on"};

constexpr NamedValues<Triad, 3> kTriadNames = {{
    {Triad::kAccelerometer, TriadName(Triad::kAccelerometer)},
    {Triad::kGyroscope, TriadName(Triad::kGyroscope)},
    {Triad::kMagnetometer, TriadName(Triad::kMagnetometer)},
}};

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

/// Reads a list with items of several kinds. Each item is a map with one key, the name of its kind;
/// the alternatives of the variant `Thing` are the kinds. The list replaces the list of earlier
/// documents.
template <typename Visit, typename Thing, std::size_t N, typename Of, std::size_t... kIndex>
void ListOfKinds(Visit& visit,
                 std::string_view key,
                 const std::array<std::string_view, N>& kinds,
                 std::vector<Thing>* things,
                 const Of& of,
                 std::index_sequence<kIndex...>) {
  static_assert(N == std::variant_size_v<Thing>);
  std::string known;
  for (const std::string_view kind : kinds) known.append(known.empty() ? "" : ", ").append(kind);
  visit.List(key, *things, [&](auto& item, Thing& thing) {
    const int count = (0 + ... + (item.Has(kinds[kIndex]) ? 1 : 0));
    item.Expect(count == 1, "expected one of " + known);
    if (Visit::kReads && count != 1) return;
    const auto read = [&](std::string_view kind, auto& alternative) {
      item.Map(kind, [&](auto& fields) { of(fields, alternative); });
    };
    ((item.Has(kinds[kIndex]) ? read(kinds[kIndex], thing.template emplace<kIndex>()) : void()),
     ...);
  });
}
template <typename Visit, typename Thing, std::size_t N, typename Of>
void ListOfKinds(Visit& visit,
                 std::string_view key,
                 const std::array<std::string_view, N>& kinds,
                 std::vector<Thing>* things,
                 const Of& of) {
  ListOfKinds(visit, key, kinds, things, of, std::make_index_sequence<N>());
}

void AttitudeSetFields(auto& visit, const std::string& file, PosesStep& step) {
  int count = 0;
  std::string program;
  const bool has_file = visit("file", program, kAnyText);
  const bool has_count = visit("spread", count, kRounds);
  visit.Expect(has_file != has_count,
               "expected one of six_face, cube, { spread: N }, { file: program.yaml }");
  if (has_count) step.poses = PosesOf(SpreadAttitudes(count));
  if (!has_file || has_count) return;
  Result<PoseProgram> read = ReadPoseProgram(Resolve(program, file));
  if (read) {
    step.poses = std::move(read->poses);
  } else {
    visit.Expect(false, read.error().message, "file");
  }
}

void StepFields(auto& visit, const std::string& file, PosesStep& step) {
  visit.Require("attitudes");
  visit.Map("attitudes",
            [&](auto& set) { AttitudeSetFields(set, file, step); },
            {.words = {{"six_face", false, [&] { step.poses = PosesOf(SixFaceAttitudes()); }},
                       {"cube", false, [&] { step.poses = PosesOf(CubeAttitudes()); }}}});
  int rounds = 1;
  visit("rounds", rounds, kRounds);
  const std::vector<ProgramPose> once = step.poses;
  const bool is_too_many = once.size() * static_cast<std::size_t>(rounds) > kMaxPoses;
  visit.Expect(!is_too_many,
               std::to_string(rounds) + " rounds of " + std::to_string(once.size()) +
                   " poses are too many; at most " + std::to_string(kMaxPoses) +
                   " poses in all are allowed",
               "rounds");
  for (int i = 1; i < rounds && !is_too_many; ++i) {
    step.poses.insert(step.poses.end(), once.begin(), once.end());
  }
  visit("rest_s", step.rest_s, kPositive);
  visit("rest_spread", step.rest_spread, Range{0.0, 0.9, "a share from 0 to 0.9"});
  visit("move_s", step.move_s, kPositive);
  visit(AngleKeys("tilt_sigma"), step.tilt_sigma_rad, kNotNegative);
  visit("travel_m", step.travel_m, kNotNegative);
  visit("shuffle", step.shuffle, Flag());
}

void StepFields(auto& visit, const std::string&, TurnStep& step) {
  visit.Require("axis");
  visit("axis", step.axis_in_body, BodyAxis());
  visit("turns", step.turns, kAnyNumber);
  visit.Expect(step.turns != 0.0, "expected a number other than zero", "turns");
  visit("duration_s", step.duration_s, kPositive);
  visit("rest_s", step.rest_s, kNotNegative);
}

void StepFields(auto& visit, const std::string&, RateStep& step) {
  visit.Require("axis");
  visit("axis", step.axis_in_body, BodyAxis());
  std::string said;
  for (const auto& [key, scale] : RateKeys("rates")) {
    if (!visit.Has(key)) continue;
    visit.Expect(said.empty(), "says the same as `" + said + "`", key);
    said = key;
    std::vector<double> rates;
    if (!visit(key, rates, NumberList())) continue;
    visit.Expect(!rates.empty(), "has no rates; list at least one", key);
    for (const double rate : rates) {
      visit.Expect(rate != 0.0,
                   "a rate of zero is not a turn; the rests between rates are added automatically",
                   key);
      step.rates_radps.push_back(scale * rate);
    }
  }
  visit.Expect(!said.empty(), "expected `rates_degps` or `rates_radps`");
  visit("hold_s", step.hold_s, kPositive);
  visit("ramp_s", step.ramp_s, kPositive);
  visit("rest_s", step.rest_s, kNotNegative);
}

void StepFields(auto& visit, const std::string&, TumbleStep& step) {
  visit("duration_s", step.duration_s, kPositive);
  visit(RateKeys("rms_rate"), step.rms_rate_radps, kPositive);
  visit("hand_acceleration_mps2", step.hand_acceleration_mps2, kNotNegative);
}

void SegmentFields(auto& visit, TemperatureHold& hold) {
  visit.Require("duration_s");
  visit("duration_s", hold.duration_s, kPositive);
}

void SegmentFields(auto& visit, TemperatureRamp& ramp) {
  visit.Require("to_degc");
  visit("to_degc", ramp.to_degc, kTemperatureDegc);
  visit(TemperatureRateKeys("rate"), ramp.rate_degcps, kPositive);
}

void SegmentFields(auto& visit, TemperatureSine& sine) {
  for (const char* key : {"amplitude_degc", "period_s", "duration_s"}) visit.Require(key);
  visit("amplitude_degc", sine.amplitude_degc, kAnyNumber);
  visit("period_s", sine.period_s, kPositive);
  visit("duration_s", sine.duration_s, kPositive);
}

void TemperatureFields(auto& visit, SimulatedTemperature& temperature) {
  constexpr std::array<std::string_view, 3> kKinds = {"hold", "ramp", "sine"};
  visit("start_degc", temperature.start_degc, kTemperatureDegc);
  ListOfKinds(visit, "profile", kKinds, &temperature.profile, [](auto& segment, auto& kind) {
    SegmentFields(segment, kind);
  });
  visit("soak_degc", temperature.soak_degc, ListOf{kTemperatureDegc});
  visit(TemperatureRateKeys("chamber_rate"), temperature.chamber_rate_degcps, kPositive);
  visit("settle_s", temperature.settle_s, kNotNegative);
  visit("element_lag_s", temperature.element_lag_s, kNotNegative);
  visit("thermometer_lag_s", temperature.thermometer_lag_s, kNotNegative);
  visit("thermometer_noise_degc", temperature.thermometer_noise_degc, kNotNegative);
  visit("thermometer_resolution_degc", temperature.thermometer_resolution_degc, kNotNegative);
  visit("hysteresis_degc", temperature.hysteresis_degc, kNotNegative);
  visit("ambient_lag_s", temperature.ambient_lag_s, kNotNegative);
  visit("ambient_noise_degc", temperature.ambient_noise_degc, kNotNegative);
  visit("ambient_resolution_degc", temperature.ambient_resolution_degc, kNotNegative);
  visit("element_ambient_share", temperature.element_ambient_share, kNotNegative);
  visit("logged", temperature.logged, Flag());
  visit("ambient_logged", temperature.ambient_logged, Flag());
}

void WhenFields(auto& visit, DisturbanceTime& when) {
  visit("rest", when.rest, kRest);
  visit("offset_s", when.offset_s, kNotNegative);
}

void DisturbanceFields(auto& visit, Knock& knock) {
  WhenFields(visit, knock.when);
  visit("duration_s", knock.duration_s, kPositive);
  visit.Expect(visit(TriadKeys("peak", Triad::kAccelerometer), knock.peak_mps2, kEach),
               "expected `peak_mps2` or `peak_g`: [x, y, z] in the body frame");
}

void DisturbanceFields(auto& visit, MagnetPassing& magnet) {
  WhenFields(visit, magnet.when);
  visit("duration_s", magnet.duration_s, kPositive);
  visit.Expect(visit(TriadKeys("peak", Triad::kMagnetometer), magnet.peak_ut, kEach),
               "expected `peak_ut`: [x, y, z] in the world frame");
}

void DisturbanceFields(auto& visit, HardIronStep& step) {
  WhenFields(visit, step.when);
  visit.Expect(visit(TriadKeys("change", Triad::kMagnetometer), step.change_ut, kEach),
               "expected `change_ut`: [x, y, z] in the body frame");
}

void DisturbanceFields(auto& visit, FieldStep& step) {
  WhenFields(visit, step.when);
  visit.Expect(visit(TriadKeys("change", Triad::kMagnetometer), step.change_ut, kEach),
               "expected `change_ut`: [x, y, z] in the world frame");
}

void DisturbanceFields(auto& visit, StuckSamples& stuck) {
  WhenFields(visit, stuck.when);
  visit.Require("sensor");
  visit("sensor", stuck.triad, kTriadNames);
  visit("duration_s", stuck.duration_s, kPositive);
}

void DisturbanceFields(auto& visit, UnsettledPose& pose) {
  visit.Require("rest");
  visit("rest", pose.rest, kRest);
  visit.Expect(visit(AngleKeys("tilt"), pose.tilt_rad, kEach),
               "expected `tilt_deg`: [x, y, z] in the body frame");
  visit("decay_s", pose.decay_s, kPositive);
}

}  // namespace

void CourseFields(auto& visit, const std::string& file, Scenario* scenario) {
  constexpr std::array<std::string_view, 4> kSteps = {"poses", "turn", "turntable", "tumble"};
  constexpr std::array<std::string_view, 6> kDisturbances = {
      "knock", "magnet", "hard_iron_step", "field_step", "stuck", "unsettled"};
  ListOfKinds(visit, "motion", kSteps, &scenario->motion, [&](auto& step, auto& kind) {
    StepFields(step, file, kind);
  });
  if (visit.IsList("motion", true)) {
    visit.Expect(!scenario->motion.empty(), "has no steps; list at least one", "motion");
  }
  visit("first_rest_s", scenario->first_rest_s, kPositive);
  visit.Map("temperature", [&](auto& of) { TemperatureFields(of, scenario->temperature); });
  ListOfKinds(visit,
              "disturbances",
              kDisturbances,
              &scenario->disturbances,
              [](auto& disturbance, auto& kind) { DisturbanceFields(disturbance, kind); });
}
template void CourseFields(FieldReader&, const std::string&, Scenario*);
template void CourseFields(FieldSchema&, const std::string&, Scenario*);

}  // namespace truetriad
