// SPDX-License-Identifier: Apache-2.0
#include "truetriad/sim/scenario.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scenario_samples.h"

namespace truetriad {
namespace scenario_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Scenario, WithSensibleValuesIsValid) {
  const Status status = QuietScenario().Validate();
  EXPECT_TRUE(status) << status.error().message;
}

TEST(Scenario, NamesEveryProblemAtOnce) {
  Scenario scenario = QuietScenario();
  scenario.sensors[Triad::kGyroscope]->noise.density[1] = -1.0;
  scenario.sensors[Triad::kMagnetometer]->sampling.rate_hz = 0.0;
  scenario.sensors[Triad::kAccelerometer]->nominal.sensitivity.setZero();
  std::get<PosesStep>(scenario.motion[0]).rest_s = 0.0;
  scenario.motion.push_back(RateStep{Eigen::Vector3d::UnitX(), {0.0}, 5.0, 1.0, 2.0});
  scenario.temperature.soak_degc = {10.0};
  scenario.temperature.profile = {TemperatureHold{5.0}};
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("gyroscope noise density is -1"),
                    HasSubstr("magnetometer rate is 0 Hz"),
                    HasSubstr("accelerometer: the sensitivity is singular"),
                    HasSubstr("motion step 1 rests for 0 s"),
                    HasSubstr("motion step 2 has a rate of 0"),
                    HasSubstr("exclude each other")));
}

TEST(Scenario, RefusesADisturbanceOfARestThatIsNotThere) {
  Scenario scenario = QuietScenario();
  Knock knock;
  knock.when.rest = 25;
  scenario.disturbances = {knock};
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              HasSubstr("disturbance 1 is set for rest 25; expected rests 1 to 24"));
}

TEST(Scenario, RefusesADisturbanceAfterTheEndOfTheRecording) {
  Scenario scenario = StillScenario(10.0);
  Knock late;
  late.when.offset_s = 10.0;
  StuckSamples in_time;
  in_time.when = {1, 9.99};
  scenario.disturbances = {in_time, late};
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "disturbance 2 begins at 10 s; the recording ends at 10 s");
}

/// 1800 deg/s at 10 Hz are 180 deg from sample to sample.
TEST(Scenario, RefusesTurnsThatAMeanRateCannotTell) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  Scenario scenario = QuietScenario();
  scenario.sensors[Triad::kGyroscope]->sampling.rate_hz = 10.0;
  scenario.motion = {RateStep{.rates_radps = {-1790.0 * kDeg}}};
  EXPECT_TRUE(scenario.Validate());
  // Its peak is 1.875 times its mean of 972 deg/s; that of the tumbling up to sqrt(6) of its RMS.
  scenario.motion = {RateStep{.rates_radps = {-1810.0 * kDeg}},
                     TurnStep{.turns = 2.7, .duration_s = 1.0},
                     TumbleStep{.rms_rate_radps = 750.0 * kDeg}};
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("motion step 1 turns at up to 1810 deg/s, which is 181 deg in one "
                              "sampling interval of the gyroscope at 10 Hz"),
                    HasSubstr("motion step 2 turns at up to 1822.5 deg/s"),
                    HasSubstr("motion step 3 turns at up to 1837.12 deg/s")));
  scenario.sensors[Triad::kGyroscope]->gyroscope_output = GyroscopeOutput::kInstantaneous;
  EXPECT_TRUE(scenario.Validate());
}

TEST(Scenario, RefusesAGainThatVanishesAtATemperatureThatIsReached) {
  Scenario scenario = QuietScenario();
  ThermalTerms& thermal = scenario.sensors[Triad::kAccelerometer]->thermal.emplace();
  thermal.reference_degc = 25.0;
  thermal.sensitivity = {-0.02 * Eigen::Matrix3d::Identity()};
  scenario.temperature.soak_degc = {25.0, 60.0};
  EXPECT_TRUE(scenario.Validate());
  scenario.temperature.soak_degc = {25.0, 80.0};
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("accelerometer: a gain is -"));
}

TEST(Scenario, BoundsTheRestsBeforeItBuildsThem) {
  Scenario scenario = QuietScenario();
  std::get<PosesStep>(scenario.motion[0]).poses.resize(100000);
  scenario.motion.push_back(scenario.motion[0]);
  scenario.temperature.soak_degc.assign(300, 20.0);
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              HasSubstr("200000 rests at each of 300 temperatures; at most 300000 in all"));
}

TEST(Scenario, KnowsMistakesInTheUnitOfGravityFieldAndClock) {
  Scenario scenario = QuietScenario();
  scenario.sensors[Triad::kAccelerometer]->range_raw = Eigen::Vector2d(-40.0, 40.0);
  scenario.world.gravity_mps2 = 980665.0;
  scenario.world.field_ut = 48000.0;
  scenario.sensors[Triad::kGyroscope]->sampling.clock_offset_s = 1e300;
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("gravity is 980665 m/s^2"),
                    HasSubstr("980665 mGal"),
                    HasSubstr("field strength is 48000 uT"),
                    HasSubstr("48000 nT"),
                    HasSubstr("gyroscope clock offset is 1e+300 s"),
                    Not(HasSubstr("saturate"))));
}

TEST(Scenario, RefusesNumbersThatAreNone) {
  Scenario scenario = QuietScenario();
  scenario.world.gravity_mps2 = std::nan("");
  scenario.sensors[Triad::kGyroscope]->noise.random_walk[2] = std::nan("");
  scenario.temperature.element_lag_s = std::nan("");
  const Status status = scenario.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("gravity"), HasSubstr("random walk"), HasSubstr("lag")));
}

}  // namespace scenario_test
}  // namespace truetriad
