// SPDX-License-Identifier: Apache-2.0
#include "sim/chamber.h"

#include <cmath>

#include <gtest/gtest.h>

namespace truetriad {
namespace chamber_test {

Chamber RampHoldAndSine() {
  Chamber chamber(20.0);
  chamber.Hold(10.0);
  chamber.Ramp({.to_degc = 50.0, .rate_degcps = 0.5});
  chamber.Hold(100.0);
  chamber.Sine({.amplitude_degc = 5.0, .period_s = 90.0, .duration_s = 200.0});
  return chamber;
}

TEST(Chamber, FollowsItsSegmentsAndHoldsTheLastValue) {
  const Chamber chamber = RampHoldAndSine();
  EXPECT_DOUBLE_EQ(chamber.end_s(), 10.0 + 60.0 + 100.0 + 200.0);
  LaggedTemperature at_once(chamber, 0.0);
  EXPECT_DOUBLE_EQ(at_once.At(5.0).degc, 20.0);
  EXPECT_DOUBLE_EQ(at_once.At(30.0).degc, 30.0);
  EXPECT_DOUBLE_EQ(at_once.At(30.0).rate_degcps, 0.5);
  EXPECT_DOUBLE_EQ(at_once.At(100.0).degc, 50.0);
  EXPECT_NEAR(at_once.At(170.0 + 22.5).degc, 55.0, 1e-12);
  EXPECT_DOUBLE_EQ(at_once.At(1e6).degc, chamber.end_degc());
}

TEST(LaggedTemperature, SolvesTheEquationOfTheLag) {
  const Chamber chamber = RampHoldAndSine();
  constexpr double kLagS = 25.0;
  LaggedTemperature truth(chamber, 0.0);
  LaggedTemperature lagged(chamber, kLagS);
  constexpr double kStepS = 1e-3;
  double before = 20.0;
  for (double time_s = kStepS; time_s < 400.0; time_s += kStepS) {
    const TemperatureState state = lagged.At(time_s);
    ASSERT_NEAR(kLagS * state.rate_degcps, truth.At(time_s).degc - state.degc, 1e-9) << time_s;
    // The value is the integral of the rate: the error of a backward difference is step / 2 times
    // the second derivative, at most about 0.5 / 25 degC/s^2.
    ASSERT_NEAR((state.degc - before) / kStepS, state.rate_degcps, 2e-5) << time_s;
    before = state.degc;
  }
}

}  // namespace chamber_test
}  // namespace truetriad
