// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "truetriad/model/calibration.h"

namespace truetriad {
namespace thermal_test {

TEST(ModelAtTemperature, IsTheStatedModelAtItsReference) {
  TriadModel<double> model;
  model.bias << 1.0, 2.0, 3.0;
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d(0.1, 0.2, 0.3)};
  thermal.sensitivity = {Eigen::Matrix3d::Ones()};
  thermal.rate[RateTerm::kCross] = Eigen::Vector3d::Ones();
  const TriadModel<double> same = ModelAtTemperature(model, thermal, 20.0, 5.0);
  EXPECT_EQ(same.bias, model.bias);
  EXPECT_EQ(same.sensitivity, model.sensitivity);
}

TEST(ModelAtTemperature, AddsEveryTermOfTheEquation) {
  TriadModel<double> model;
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d::Constant(1.0), Eigen::Vector3d::Constant(10.0)};
  thermal.sensitivity = {Eigen::Matrix3d::Constant(1.0),
                         Eigen::Matrix3d::Constant(2.0),
                         Eigen::Matrix3d::Constant(3.0)};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d::Constant(100.0);
  thermal.rate[RateTerm::kQuadratic] = Eigen::Vector3d::Constant(1000.0);
  thermal.rate[RateTerm::kCross] = Eigen::Vector3d::Constant(1e4);
  // tau = 2, rate = -3; outside any range, since nothing is clamped.
  const TriadModel<double> at = ModelAtTemperature(model, thermal, 22.0, -3.0);
  EXPECT_EQ(at.bias.x(), 2.0 + 40.0 - 300.0 + 9000.0 - 6e4);
  EXPECT_EQ(at.sensitivity(0, 0), 1.0 + 2.0 + 8.0 + 24.0);
  EXPECT_EQ(at.sensitivity(0, 1), 2.0 + 8.0 + 24.0);
}

TEST(ModelAtTemperature, TakesEachAxisAtItsOwnTemperature) {
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d(1.0, 2.0, 3.0)};
  thermal.sensitivity = {Eigen::Matrix3d::Ones()};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d(10.0, 10.0, 10.0);
  const TriadModel<double> at =
      ModelAtTemperature(TriadModel<double>(), thermal, {{21.0, 22.0, 23.0}, {0.0, 1.0, 2.0}});
  EXPECT_EQ(at.bias, Eigen::Vector3d(1.0, 2.0 * 2.0 + 10.0, 3.0 * 3.0 + 20.0));
  EXPECT_EQ(at.sensitivity(2, 0), 3.0);
}

// lag y' = x - y with x = r t from rest: y = r (t - lag (1 - e^(-t/lag))), whatever the spacing.
TEST(FirstOrderLag, IsExactOnAStraightLineAtAnySpacing) {
  constexpr double kLag = 60.0, kRate = 0.05;
  FirstOrderLag lag(kLag);
  lag.Next(0.0, 0.0);
  double time = 0.0;
  for (const double step : {0.1, 50.0, 1.0, 300.0}) {
    time += step;
    const double expected = kRate * (time - kLag * (1.0 - std::exp(-time / kLag)));
    EXPECT_NEAR(lag.Next(time, kRate * time), expected, 1e-13);
  }
}

TEST(TemperatureFilter, GivesLagAndRateOfASteadyRamp) {
  ThermalTerms thermal;
  thermal.element_lag_s = Eigen::Vector3d(0.0, 60.0, 60.0);
  thermal.rate_lag_s = Eigen::Vector3d(100.0, 0.0, 100.0);
  TemperatureFilter filter(thermal);
  ThermalState state;
  constexpr double kRate = 0.05;
  for (int i = 0; i <= 4000; ++i) state = filter.Next(i, kRate * i);
  // e^-40 is left of the start.
  EXPECT_NEAR(state.degc.x(), 4000.0 * kRate, 1e-9);
  EXPECT_NEAR(state.degc.y(), 3940.0 * kRate, 1e-9);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(state.rate_degcps[axis], kRate, 1e-9);
  // What is not known changes nothing.
  EXPECT_EQ(filter.Next(5000.0, std::nan("")).degc, state.degc);
}

}  // namespace thermal_test
}  // namespace truetriad
