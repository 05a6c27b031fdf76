// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace scenario_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr double kDeg = std::numbers::pi / 180.0;
constexpr double kMilliG = kStandardGravityMps2 * 1e-3;

const std::string kHead = "scenario: 1\n";
const std::string kMotion = "motion: [{ poses: { attitudes: six_face } }]\n";
const std::string kSensors = "sensors: { accelerometer: {} }\n";

class ScenarioConfig : public ::testing::Test {
 protected:
  Result<Scenario> Load(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return ReadScenario(folder_.Write("scenario.yaml", text), overrides);
  }
  Scenario LoadWell(const std::string& text, const std::vector<std::string>& overrides = {}) {
    Result<Scenario> scenario = Load(text, overrides);
    EXPECT_TRUE(scenario) << scenario.error().message;
    return scenario ? *scenario : Scenario();
  }
  std::string ErrorOf(const std::string& text, const std::vector<std::string>& overrides = {}) {
    const Result<Scenario> scenario = Load(text, overrides);
    return scenario ? "no error" : scenario.error().message;
  }
  /// The one sensor of a scenario that says `text` of it.
  SimulatedTriad Sensor(Triad triad, const std::string& text) {
    const std::string name(TriadName(triad));
    const Scenario scenario =
        LoadWell(kHead + "sensors: { " + name + ": { " + text + " } }\n" + kMotion);
    return scenario.sensors[triad].value_or(SimulatedTriad());
  }
  std::string SensorError(Triad triad, const std::string& text) {
    const std::string name(TriadName(triad));
    return ErrorOf(kHead + "sensors: { " + name + ": { " + text + " } }\n" + kMotion);
  }

  TemporaryFolder folder_;
};

TEST_F(ScenarioConfig, NeedsOnlyTheVersionASensorAndAMotion) {
  const Scenario scenario = LoadWell(kHead + kSensors + kMotion);
  const Scenario defaults;
  EXPECT_EQ(scenario.count, 1);
  EXPECT_EQ(scenario.seed, defaults.seed);
  EXPECT_EQ(scenario.world.field_ut, defaults.world.field_ut);
  ASSERT_TRUE(scenario.sensors[Triad::kAccelerometer]);
  EXPECT_FALSE(scenario.sensors[Triad::kGyroscope]);
  const SimulatedTriad& sensor = *scenario.sensors[Triad::kAccelerometer];
  EXPECT_EQ(sensor.unit.name, "m/s^2");
  EXPECT_EQ(sensor.nominal.sensitivity, Eigen::Matrix3d::Identity());
  EXPECT_EQ(sensor.noise.density, Eigen::Vector3d::Zero());
  EXPECT_EQ(sensor.resolution_raw, 0.0);
  EXPECT_FALSE(sensor.range_raw);
  ASSERT_THAT(scenario.motion, SizeIs(1));
  EXPECT_THAT(std::get<PosesStep>(scenario.motion[0]).poses, SizeIs(6));
}

TEST_F(ScenarioConfig, TakesTheUnitsOfDataSheets) {
  const SimulatedTriad accelerometer = Sensor(
      Triad::kAccelerometer,
      "unit: g, bias_mg: 60, scale_error_percent: [1, 0, -2], range_g: 4, quadratic_ug_g2: 200, "
      "cubic_ug_g3: -50, spread: { cubic_per_m2ps4: 1e-6 }, "
      "resolution_ug: 122, noise: { noise_density_ug_rthz: [100, 200, 300], "
      "bias_instability_ug: 40, bias_random_walk_mps2_rth: 6e-3 }");
  EXPECT_NEAR(accelerometer.nominal.bias[1], 0.06, 1e-15);
  EXPECT_DOUBLE_EQ(accelerometer.nominal.sensitivity(2, 2), 0.98 / kStandardGravityMps2);
  // 200 ug more than 1 g at 1 g.
  EXPECT_NEAR(accelerometer.nominal.axis_terms[AxisTerm::kQuadratic][2], 200e-6, 1e-18);
  EXPECT_NEAR(accelerometer.nominal.axis_terms[AxisTerm::kCubic][2], -50e-6, 1e-18);
  EXPECT_EQ(accelerometer.spread.axis_terms[AxisTerm::kCubic], 1e-6);
  EXPECT_DOUBLE_EQ(accelerometer.noise.density[2], 0.3 * kMilliG);
  EXPECT_DOUBLE_EQ(accelerometer.noise.instability_sigma[0], 0.04 * kMilliG);
  EXPECT_DOUBLE_EQ(accelerometer.noise.random_walk[0], 1e-4);
  EXPECT_DOUBLE_EQ(accelerometer.resolution_raw, 122e-6);
  EXPECT_NEAR((*accelerometer.range_raw - Eigen::Vector2d(-4.0, 4.0)).norm(), 0.0, 1e-14);

  const SimulatedTriad gyroscope =
      Sensor(Triad::kGyroscope,
             "unit: deg/s, bias_degph: 3600, misalignment_mrad: [[0, 1, 2], [3, 0, 4], [5, 6, 0]], "
             "asymmetry_ppm: [100, 0, -50], g_sensitivity_degps_g: [[0.1, 0, 0], [0, 0.1, 0], [0, "
             "0, 0.1]], "
             "noise: { angle_random_walk_deg_rth: 0.3, bias_instability_degph: 3.5 }");
  EXPECT_NEAR(gyroscope.nominal.bias[0], 1.0, 1e-14);
  EXPECT_NEAR(gyroscope.nominal.sensitivity(1, 0), 3e-3 / kDeg, 1e-14);
  EXPECT_NEAR(gyroscope.nominal.axis_terms[AxisTerm::kAsymmetry][2], -5e-5, 1e-18);
  EXPECT_NEAR((*gyroscope.g_sensitivity)(2, 2), 0.1 / kStandardGravityMps2, 1e-15);
  EXPECT_DOUBLE_EQ(gyroscope.noise.density[0], 0.3 * kDeg / 60.0);
  EXPECT_DOUBLE_EQ(gyroscope.noise.instability_sigma[0], 3.5 * kDeg / 3600.0);

  const SimulatedTriad magnetometer =
      Sensor(Triad::kMagnetometer,
             "unit: mG, bias_nt: 500, noise: { sample_sigma_ut: 0.2 }, sampling: { rate_hz: 25, "
             "jitter_us: 100, dropout: 0.01, clock_offset_ms: -3 }");
  EXPECT_DOUBLE_EQ(magnetometer.nominal.bias[0], 5.0);
  EXPECT_DOUBLE_EQ(magnetometer.noise.density[0], 0.2 / std::sqrt(25.0));
  EXPECT_DOUBLE_EQ(magnetometer.sampling.jitter_s, 1e-4);
  EXPECT_DOUBLE_EQ(magnetometer.sampling.clock_offset_s, -3e-3);
}

TEST_F(ScenarioConfig, PutsCountsAboutTheirZeroAndRoundsThem) {
  const SimulatedTriad sensor = Sensor(Triad::kAccelerometer,
                                       "unit: counts, counts_per_g: 4096, zero_raw: 32768, "
                                       "bias_mg: [100, 0, 0], range_g: 8");
  const double gain = 4096.0 / kStandardGravityMps2;
  EXPECT_DOUBLE_EQ(*sensor.si_per_count, 1.0 / gain);
  EXPECT_DOUBLE_EQ(sensor.nominal.sensitivity(0, 0), gain);
  EXPECT_NEAR(sensor.nominal.bias[0], 32768.0 + 409.6, 1e-9);
  EXPECT_EQ(sensor.resolution_raw, 1.0);
  EXPECT_NEAR((*sensor.range_raw - Eigen::Vector2d(0.0, 65536.0)).norm(), 0.0, 1e-9);
}

TEST_F(ScenarioConfig, StatesThermalTermsPerTrueUnit) {
  const SimulatedTriad sensor =
      Sensor(Triad::kAccelerometer,
             "unit: counts, si_per_count: 0.001, thermal: { reference_degc: 20, bias_mg_degc: 1, "
             "bias_mps2_degc3: [1e-6, 0, 0], scale_percent_degc: [0.01, 0.02, 0.03], "
             "rate_mps2_degcps: [0, 0, 2] }");
  ASSERT_TRUE(sensor.thermal);
  EXPECT_EQ(sensor.thermal->reference_degc, 20.0);
  ASSERT_THAT(sensor.thermal->bias, SizeIs(3));
  EXPECT_NEAR(sensor.thermal->bias[0][2], 1000.0 * kMilliG, 1e-12);
  EXPECT_EQ(sensor.thermal->bias[1], Eigen::Vector3d::Zero());
  EXPECT_NEAR(sensor.thermal->bias[2][0], 1e-3, 1e-15);
  ASSERT_THAT(sensor.thermal->sensitivity, SizeIs(1));
  EXPECT_NEAR(sensor.thermal->sensitivity[0](2, 2), 0.3, 1e-12);
  EXPECT_EQ((*sensor.thermal->rate[RateTerm::kLinear])[2], 2000.0);
  EXPECT_FALSE(sensor.thermal->rate[RateTerm::kCross]);
}

TEST_F(ScenarioConfig, ReadsEveryKindOfMotion) {
  folder_.Write("poses.yaml",
                "program: 1\nposes: [{ attitude: [1, 0, 0, 0], temperature_degc: 30 }]\n");
  const Scenario scenario =
      LoadWell(kHead + kSensors +
               "first_rest_s: 5\nmotion:\n"
               "  - poses: { attitudes: cube, rounds: 2, rest_s: 3, rest_spread: 0.1, move_s: 2,\n"
               "             tilt_sigma_deg: 0.5, travel_m: 0.3, shuffle: true }\n"
               "  - poses: { attitudes: { spread: 10 } }\n"
               "  - poses: { attitudes: { file: poses.yaml } }\n"
               "  - turn: { axis: -y, turns: -2, duration_s: 8, rest_s: 0 }\n"
               "  - turntable: { axis: [1, 1, 0], rates_degps: [10, -10], hold_s: 4, ramp_s: 2, "
               "rest_s: 1 }\n"
               "  - tumble: { duration_s: 30, rms_rate_degps: 90 }\n");
  EXPECT_EQ(scenario.first_rest_s, 5.0);
  ASSERT_THAT(scenario.motion, SizeIs(6));
  const auto& cube = std::get<PosesStep>(scenario.motion[0]);
  EXPECT_THAT(cube.poses, SizeIs(48));
  EXPECT_DOUBLE_EQ(cube.tilt_sigma_rad, 0.5 * kDeg);
  EXPECT_TRUE(cube.shuffle);
  EXPECT_THAT(std::get<PosesStep>(scenario.motion[1]).poses, SizeIs(10));
  EXPECT_EQ(std::get<PosesStep>(scenario.motion[2]).poses[0].temperature_degc, 30.0);
  const auto& turn = std::get<TurnStep>(scenario.motion[3]);
  EXPECT_EQ(turn.axis_in_body, -Eigen::Vector3d::UnitY());
  EXPECT_EQ(turn.turns, -2.0);
  EXPECT_DOUBLE_EQ(std::get<RateStep>(scenario.motion[4]).rates_radps[1], -10.0 * kDeg);
  EXPECT_DOUBLE_EQ(std::get<TumbleStep>(scenario.motion[5]).rms_rate_radps, 90.0 * kDeg);
}

TEST_F(ScenarioConfig, ReadsTemperatureAndDisturbances) {
  const Scenario scenario = LoadWell(
      kHead + "sensors: { accelerometer: {}, magnetometer: {} }\n" + kMotion +
      "temperature:\n"
      "  start_degc: 20\n"
      "  profile: [{ hold: { duration_s: 60 } }, { ramp: { to_degc: 50, rate_degc_min: 3 } },\n"
      "            { sine: { amplitude_degc: 2, period_s: 600, duration_s: 1200 } }]\n"
      "  element_lag_s: 30\n"
      "  hysteresis_degc: 0.5\n"
      "  logged: false\n"
      "disturbances:\n"
      "  - knock: { rest: 2, offset_s: 1, peak_g: [0.5, 0, 0] }\n"
      "  - magnet: { offset_s: 3, duration_s: 1, peak_ut: [0, 0, 20] }\n"
      "  - stuck: { sensor: magnetometer, rest: 1 }\n"
      "  - unsettled: { rest: 3, tilt_deg: [2, 0, 0], decay_s: 0.3 }\n");
  ASSERT_THAT(scenario.temperature.profile, SizeIs(3));
  EXPECT_DOUBLE_EQ(std::get<TemperatureRamp>(scenario.temperature.profile[1]).rate_degcps, 0.05);
  EXPECT_EQ(scenario.temperature.hysteresis_degc, 0.5);
  EXPECT_FALSE(scenario.temperature.logged);
  ASSERT_THAT(scenario.disturbances, SizeIs(4));
  EXPECT_DOUBLE_EQ(std::get<Knock>(scenario.disturbances[0]).peak_mps2[0], 500.0 * kMilliG);
  EXPECT_EQ(std::get<Knock>(scenario.disturbances[0]).when.rest, 2);
  EXPECT_FALSE(std::get<MagnetPassing>(scenario.disturbances[1]).when.rest);
  EXPECT_EQ(std::get<StuckSamples>(scenario.disturbances[2]).triad, Triad::kMagnetometer);
  EXPECT_DOUBLE_EQ(std::get<UnsettledPose>(scenario.disturbances[3]).tilt_rad[0], 2.0 * kDeg);
}

TEST_F(ScenarioConfig, ChangesJustWhatItNamesOfItsBase) {
  folder_.Write("base.yaml",
                kHead + kMotion +
                    "seed: 7\nsensors:\n"
                    "  accelerometer: { bias_mg: 10, noise: { noise_density_ug_rthz: 100, "
                    "bias_instability_ug: 10 } }\n"
                    "  magnetometer: { bias_ut: 3 }\n");
  const Scenario scenario =
      LoadWell(kHead +
                   "base: base.yaml\nsensors:\n"
                   "  accelerometer: { noise: { velocity_random_walk_mps_rth: 0.06 } }\n"
                   "  magnetometer: none\n",
               {"seed=8", "sensors.accelerometer.bias_mps2=[1, 2, 3]"});
  EXPECT_EQ(scenario.seed, 8U);
  EXPECT_FALSE(scenario.sensors[Triad::kMagnetometer]);
  const SimulatedTriad& sensor = *scenario.sensors[Triad::kAccelerometer];
  EXPECT_EQ(sensor.nominal.bias, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_DOUBLE_EQ(sensor.noise.density[0], 1e-3);
  EXPECT_DOUBLE_EQ(sensor.noise.instability_sigma[0], 0.01 * kMilliG);
  EXPECT_THAT(scenario.motion, SizeIs(1));
}

TEST_F(ScenarioConfig, NamesFileAndLineOfEachErrorAllAtOnce) {
  EXPECT_THAT(ErrorOf("scenario: 1\n"
                      "seed: -1\n"
                      "count: 0\n"
                      "sensors:\n"
                      "  accelerometer:\n"
                      "    noise: { noise_density_ug_rthz: -3 }\n"
                      "    sampling: { rate_hz: 0 }\n"
                      "    bias_mp2: 3\n"
                      "  gyroscope: { unit: m/s^2 }\n"
                      "motion:\n"
                      "  - poses: { attitudes: cube, rest_s: 0 }\n"
                      "  - turntable: { axis: z, rates_degps: [10, 0] }\n"
                      "  - tumble: { duration_s: -1 }\n"
                      "  - wobble: {}\n"),
              AllOf(HasSubstr("scenario.yaml:2: seed: `-1` is not a seed"),
                    HasSubstr("scenario.yaml:3: count: `0` is out of range; expected 1 to 9999"),
                    HasSubstr(":6: sensors.accelerometer.noise.noise_density_ug_rthz: `-3` is out"),
                    HasSubstr(":7: sensors.accelerometer.sampling.rate_hz: `0` is out of range"),
                    HasSubstr(":8: sensors.accelerometer.bias_mp2: is not a known key"),
                    HasSubstr(":9: sensors.gyroscope.unit: `m/s^2` is not a unit of the"),
                    HasSubstr(":11: motion[0].poses.rest_s: `0` is out of range"),
                    HasSubstr(":12: motion[1].turntable.rates_degps: a rate of zero"),
                    HasSubstr(":13: motion[2].tumble.duration_s: `-1` is out of range"),
                    HasSubstr(":14: motion[3]: expected one of poses, turn, turntable, tumble")));
}

TEST_F(ScenarioConfig, RefusesWhatIsSaidTwice) {
  EXPECT_THAT(SensorError(Triad::kAccelerometer, "bias_mg: 3, bias_mps2: 1"),
              HasSubstr("states the same quantity as"));
  EXPECT_THAT(SensorError(Triad::kAccelerometer,
                          "sensitivity: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], scale_error: 0.1"),
              HasSubstr("keep one"));
  EXPECT_THAT(
      SensorError(Triad::kMagnetometer, "noise: { sample_sigma_ut: 1, noise_density_ut_rthz: 1 }"),
      HasSubstr("keep one"));
  EXPECT_THAT(SensorError(Triad::kAccelerometer, "unit: counts, si_per_count: 1, counts_per_g: 3"),
              HasSubstr("says the same as"));
  EXPECT_THAT(ErrorOf(kHead + kSensors + "motion: [{ poses: { attitudes: cube }, turn: {} }]\n"),
              HasSubstr("expected one of poses, turn, turntable, tumble"));
}

TEST_F(ScenarioConfig, RefusesWhatContradictsItself) {
  EXPECT_THAT(SensorError(Triad::kAccelerometer, "unit: counts"),
              HasSubstr("scenario.yaml:2: sensors.accelerometer: readings are in counts"));
  EXPECT_THAT(SensorError(Triad::kAccelerometer, "counts_per_g: 100"),
              HasSubstr("the readings are in m/s^2"));
  EXPECT_THAT(
      SensorError(Triad::kAccelerometer, "misalignment_deg: [[1, 0, 0], [0, 0, 0], [0, 0, 0]]"),
      HasSubstr("expected zeros on the diagonal"));
  EXPECT_THAT(ErrorOf(kHead + kMotion), HasSubstr("sensor"));
  EXPECT_THAT(ErrorOf(kHead + kSensors), HasSubstr("motion"));
  EXPECT_THAT(ErrorOf(kHead + kSensors + "motion: []\n"), HasSubstr("has no steps"));
  EXPECT_THAT(ErrorOf(kSensors + kMotion), HasSubstr("scenario: is missing"));
}

TEST_F(ScenarioConfig, NamesTheFileThatIsWrong) {
  EXPECT_THAT(ErrorOf(kHead + "base: none.yaml\n" + kSensors + kMotion), HasSubstr("none.yaml"));
  folder_.Write("base.yaml", kHead + "base: other.yaml\nseed: x\n");
  EXPECT_THAT(ErrorOf(kHead + "base: base.yaml\n" + kSensors + kMotion),
              AllOf(HasSubstr("base.yaml:2: base: this scenario is the base of another"),
                    HasSubstr("base.yaml:3: seed: `x` is not a seed")));
  folder_.Write("poses.yaml", "program: 1\nposes: []\n");
  EXPECT_THAT(
      ErrorOf(kHead + kSensors + "motion: [{ poses: { attitudes: { file: poses.yaml } } }]\n"),
      HasSubstr("poses.yaml:2: poses: has no poses"));
  EXPECT_THAT(ErrorOf(kHead + kSensors + kMotion, {"sed=3"}),
              AllOf(HasSubstr("--set=sed=3: sed: is not a known key"), Not(HasSubstr("yaml:"))));
}

TEST_F(ScenarioConfig, RefusesSensorsThatSeeNothingWithTheirLine) {
  EXPECT_THAT(SensorError(Triad::kAccelerometer, "range_g: 0.5"),
              AllOf(HasSubstr("scenario.yaml:2: accelerometer range is -4.9"),
                    HasSubstr("would saturate")));
  EXPECT_THAT(SensorError(Triad::kMagnetometer, "range_ut: 40"), HasSubstr("would saturate"));
  EXPECT_THAT(SensorError(Triad::kMagnetometer, "resolution_ut: 50"),
              HasSubstr("no signal would be visible"));
  EXPECT_EQ(SensorError(Triad::kGyroscope, "range_degps: 1"), "no error");
  EXPECT_THAT(
      SensorError(Triad::kAccelerometer, "unit: counts, counts_per_g: 100, resolution_g: 0.5"),
      HasSubstr("no error"));
  EXPECT_THAT(
      SensorError(Triad::kAccelerometer, "unit: counts, counts_per_g: 16384, resolution_mg: 0.1"),
      AllOf(HasSubstr("scenario.yaml:2: sensors.accelerometer"), HasSubstr("resolution_raw: 1")));
}

TEST_F(ScenarioConfig, NamesTheLineOfWhatOnlyTheWholeScenarioShows) {
  const std::string error = ErrorOf(
      "scenario: 1\n"
      "sensors:\n"
      "  gyroscope: { sampling: { rate_hz: 2.0e+6 } }\n"
      "motion:\n"
      "  - poses: { attitudes: cube }\n"
      "  - turntable: { axis: z, rates_degps: [10], ramp_s: 1 }\n"
      "disturbances:\n"
      "  - knock: { rest: 1, peak_g: [1, 0, 0] }\n"
      "  - stuck: { sensor: accelerometer, rest: 1 }\n");
  EXPECT_THAT(error,
              AllOf(HasSubstr("scenario.yaml:3: gyroscope rate is 2e+06 Hz"),
                    HasSubstr("scenario.yaml:9: disturbance 2 affects the accelerometer")));
}

TEST_F(ScenarioConfig, NamesTheLineOfATurnThatAMeanRateCannotTell) {
  EXPECT_THAT(ErrorOf(kHead + "sensors: { gyroscope: { sampling: { rate_hz: 10 } } }\nmotion:\n"
                              "  - turntable: { axis: z, rates_degps: [90] }\n"
                              "  - turntable: { axis: z, rates_degps: [2000] }\n"),
              AllOf(HasSubstr("scenario.yaml:5: motion step 2 turns at up to 2000 deg/s"),
                    HasSubstr("write `output: instantaneous`")));
}

TEST_F(ScenarioConfig, NamesTheLineOfMistakesInTheUnitsOfTheWorld) {
  EXPECT_THAT(ErrorOf(kHead + kSensors + kMotion +
                      "world:\n  gravity_mps2: 980665\n  field: { strength_ut: 48000 }\n"),
              AllOf(HasSubstr("scenario.yaml:5: gravity is 980665 m/s^2"),
                    HasSubstr("scenario.yaml:6: field strength is 48000 uT")));
}

TEST_F(ScenarioConfig, RefusesSoaksOfAProgramThatHasTemperatures) {
  folder_.Write("program.yaml",
                "program: 1\nposes: [{ attitude: [1, 0, 0, 0], temperature_degc: 30 }]\n");
  EXPECT_THAT(
      ErrorOf(kHead + kSensors +
              "motion:\n  - poses: { attitudes: { file: program.yaml } }\n"
              "temperature: { soak_degc: [0, 20] }\n"),
      AllOf(HasSubstr("scenario.yaml:4: motion step 1 has poses with their own temperatures"),
            HasSubstr("excludes `soak_degc`")));
}

TEST_F(ScenarioConfig, RefusesMoreRoundsThanItWouldGo) {
  EXPECT_THAT(
      ErrorOf(kHead + kSensors +
              "motion:\n  - poses:\n      attitudes: cube\n"
              "      rounds: 5000\n"),
      AllOf(HasSubstr("scenario.yaml:6: motion[0].poses.rounds: 5000 rounds of 24 poses are too"),
            HasSubstr("at most 100000 poses")));
}

TEST_F(ScenarioConfig, TakesNoRowsOfPosesForAProgram) {
  std::string rows = "poses:\n";
  for (int i = 0; i < 20; ++i) rows += "  - { first: 0, last: 9, id: \"1\" }\n";
  folder_.Write("poses.yaml", rows);
  const std::string error =
      ErrorOf(kHead + kSensors + "motion: [{ poses: { attitudes: { file: poses.yaml } } }]\n");
  EXPECT_THAT(error, HasSubstr("poses.yaml:1: program: is missing"));
  // One line for the file; another of the motion, which is then empty.
  EXPECT_LE(std::count(error.begin(), error.end(), '\n'), 1) << error;
}

TEST_F(ScenarioConfig, RefusesRestsTooShortForTwoSamples) {
  EXPECT_THAT(
      ErrorOf(kHead + "sensors: { accelerometer: { sampling: { rate_hz: 1 } } }\n"
                      "motion: [{ poses: { attitudes: cube, rest_s: 3, rest_spread: 0.5 } }]\n"),
      HasSubstr("scenario.yaml:3: motion step 1 rests for as little as 1.5 s"));
}

TEST_F(ScenarioConfig, TakesEverySeedOf64BitsAndNoOther) {
  EXPECT_EQ(LoadWell(kHead + "seed: 18446744073709551615\n" + kSensors + kMotion).seed,
            18446744073709551615U);
  for (const std::string seed : {"-1", "1.5", "18446744073709551616", "abc"}) {
    EXPECT_THAT(ErrorOf(kHead + "seed: " + seed + "\n" + kSensors + kMotion),
                HasSubstr("scenario.yaml:2: seed: `" + seed + "` is not a seed"));
  }
}

/// `bias_mg_degc2` as docs/simulation.md writes it: U for the unit of a sensor, A for that of an
/// angle, D for that of a duration, the plain name of a share, the first order of a polynomial.
std::string InDocs(const std::string& key) {
  const std::vector<std::pair<std::string, std::string>> rules = {
      {"_(mps2|g|mg|ug|radps|degps|degph|ut|nt|mgauss)(_|$)", "_U$2"},
      {"_(rad|mrad|deg)$", "_A"},
      {"^(jitter|clock_offset)_(s|ms|us)$", "$1_D"},
      {"_(percent|ppm)(_|$)", "$2"},
      {"_degc[23]$", "_degc"}};
  std::string text = key;
  for (const auto& [pattern, replacement] : rules) {
    text = std::regex_replace(text, std::regex(pattern), replacement);
  }
  return text;
}

/// The refusal of an unknown key lists those that the reader knows, so that no list of its own can
/// fall behind.
TEST_F(ScenarioConfig, HasEveryKeyInTheDocs) {
  const std::string sensor =
      "{ x: 1, noise: { x: 1 }, thermal: { x: 1 }, spread: { x: 1 }, sampling: { x: 1 } }\n";
  const std::string error = ErrorOf(
      "scenario: 1\nx: 1\ndevice: { x: 1 }\n"
      "world: { x: 1, field: { x: 1 }, earth_rate: { x: 1 } }\n"
      "sensors:\n  x: 1\n  accelerometer: " +
      sensor + "  gyroscope: " + sensor + "  magnetometer: " + sensor +
      "motion:\n- x: 1\n- poses: { x: 1, attitudes: { x: 1 } }\n- turn: { x: 1 }\n"
      "- turntable: { x: 1 }\n- tumble: { x: 1 }\n"
      "temperature:\n  x: 1\n"
      "  profile: [{ x: 1 }, { hold: { x: 1 } }, { ramp: { x: 1 } }, { sine: { x: 1 } }]\n"
      "disturbances: [{ x: 1 }, { knock: { x: 1 } }, { magnet: { x: 1 } }, { stuck: { x: 1 } }, "
      "{ unsettled: { x: 1 } }]\n");
  const std::string docs = TemporaryFolder::Read(TRUETRIAD_SOURCE_DIR "/docs/simulation.md");
  const std::string start = "expected one of ";
  const std::string kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_";
  std::set<std::string> keys;
  for (std::size_t at = error.find(start); at != std::string::npos; at = error.find(start, at)) {
    at += start.size();
    std::istringstream list(error.substr(at, error.find_first_of("\n;", at) - at));
    for (std::string key; std::getline(list >> std::ws, key, ',');) {
      const bool is_key = key.find_first_not_of(kLetters) == std::string::npos;
      if (is_key) keys.insert(key);
    }
  }
  EXPECT_THAT(keys, ::testing::SizeIs(::testing::Gt(200U)));
  for (const std::string& key : keys) {
    const auto has = [&docs](const std::string& name) {
      return std::regex_search(docs, std::regex("[`{ ]" + name + "[`,: ]"));
    };
    EXPECT_TRUE(has(key) || has(InDocs(key))) << key << ", or " << InDocs(key);
  }
}

TEST(ShippedScenarios, Load) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(TRUETRIAD_SOURCE_DIR) / "configs/scenarios")) {
    const Result<Scenario> scenario = ReadScenario(entry.path().string());
    EXPECT_TRUE(scenario) << scenario.error().message;
    ++count;
  }
  EXPECT_GE(count, 1);
}

}  // namespace scenario_test
}  // namespace truetriad
