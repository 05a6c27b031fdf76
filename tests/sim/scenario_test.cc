// SPDX-License-Identifier: Apache-2.0
#include "truetriad/sim/scenario.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scenario_samples.h"

namespace truetriad {
namespace {

using testing::AllOf;
using testing::HasSubstr;

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
                    HasSubstr("accelerometer: the sensitivity cannot be inverted"),
                    HasSubstr("motion step 1 rests for 0 s; poses that never rest"),
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
              HasSubstr("disturbance 1 happens in rest 25; there are rests 1 to 24"));
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

}  // namespace
}  // namespace truetriad
