// SPDX-License-Identifier: Apache-2.0
#include "verdict/limits.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "truetriad/model/quality.h"

namespace truetriad {
namespace limits_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A bias whose axes have the values and σ given, in m/s².
Calibration WithBias(const Eigen::Vector3d& bias, const Eigen::Vector3d& sigma) {
  Calibration calibration;
  TriadCalibration& sensor = calibration.sensors[Triad::kAccelerometer].emplace();
  sensor.model.bias = bias;
  sensor.bias_sigma = sigma;
  calibration.quality.effective_dof = kInfinity;
  return calibration;
}

LimitCheck Judge(const Calibration& calibration,
                 const std::string& name,
                 const Limit& limit,
                 double k = 0.0) {
  LimitOptions limits;
  limits.limits[name] = limit;
  limits.guard_band_k = k;
  PoseSet poses;
  StreamSummary& stream = poses.streams.emplace_back();
  stream.triad = Triad::kAccelerometer;
  stream.unit = {"m/s^2", 1.0, false};
  const auto checks = JudgeLimits(calibration, poses, limits);
  EXPECT_TRUE(checks) << checks.error().message;
  return checks && checks->size() == 1 ? checks->front() : LimitCheck();
}

TEST(Limits, GuardBandIsThatOfTheAxisWhichComesNearest) {
  // y is the largest value, x with its σ the nearest to the limit.
  const Calibration calibration = WithBias({0.0003, 0.002, 0.0}, {0.0064, 0.0001, 0.0001});
  const std::string bias = "accelerometer.bias";
  EXPECT_TRUE(Judge(calibration, bias, Limit::Within(0.011)).pass);
  EXPECT_EQ(Judge(calibration, bias, Limit::Within(0.011)).worst, 0.002);
  const LimitCheck guarded = Judge(calibration, bias, Limit::Within(0.011), 2.0);
  EXPECT_FALSE(guarded.pass);
  EXPECT_EQ(guarded.worst, 0.0003);
  EXPECT_NEAR(guarded.sigma, 0.0064, 1e-12);
  EXPECT_EQ(guarded.FullName(), "accelerometer.bias.x");
  EXPECT_TRUE(Judge(calibration, bias, Limit::Within(0.0132), 2.0).pass);
}

TEST(Limits, HaveTwoSidesAndStateTheChanceThatTheTruthIsOutside) {
  const Calibration calibration = WithBias({0.10, -0.30, 0.20}, Eigen::Vector3d::Constant(0.01));
  const LimitCheck y = Judge(calibration, "accelerometer.bias.y", {-0.28, 0.0, -0.2});
  EXPECT_FALSE(y.pass);
  EXPECT_EQ(y.worst, -0.30);
  EXPECT_EQ(y.component, "");
  EXPECT_NEAR(y.outside, 0.977250, 1e-6);  // two σ below
  const LimitCheck x = Judge(calibration, "accelerometer.bias.x", {0.09, 0.11, std::nullopt});
  EXPECT_TRUE(x.pass);
  EXPECT_NEAR(x.outside, 2.0 * 0.158655, 1e-6);  // a σ to either side
  EXPECT_TRUE(Judge(calibration, "accelerometer.bias", Limit{-kInfinity, 0.2, std::nullopt}).pass);
  EXPECT_NEAR(
      Judge(calibration, "accelerometer.bias", Limit{-kInfinity, 0.2, std::nullopt}).outside,
      0.5,
      1e-9);
  const LimitCheck sigma = Judge(calibration, "accelerometer.bias_sigma", Limit::Within(0.005));
  EXPECT_FALSE(sigma.pass);
  EXPECT_NEAR(sigma.worst, 0.01, 1e-12);
  EXPECT_EQ(sigma.outside, 1.0);
}

TEST(Limits, StateTheChanceThatAnyAxisIsOutside) {
  // x is nearest to its limit, z is by its σ the likelier one beyond.
  const Calibration calibration = WithBias({0.19, 0.0, 0.18}, {0.001, 0.001, 0.01});
  const LimitCheck check = Judge(calibration, "accelerometer.bias", Limit::Within(0.2));
  EXPECT_EQ(check.worst, 0.19);
  EXPECT_NEAR(check.outside, 0.022750, 1e-6);
  const Calibration two = WithBias({0.2, 0.2, 0.0}, Eigen::Vector3d::Constant(0.001));
  EXPECT_NEAR(Judge(two, "accelerometer.bias", Limit::Within(0.2)).outside, 0.75, 1e-9);
}

TEST(Limits, JudgeEveryAxisByItself) {
  const Calibration calibration = WithBias({0.19, 0.0, -0.25}, {0.001, 0.001, 0.01});
  const LimitCheck all = Judge(calibration, "accelerometer.bias", Limit::Within(0.2));
  ASSERT_EQ(all.components.size(), 3u);
  EXPECT_EQ(all.components[0].component, "x");
  EXPECT_EQ(all.components[0].value, 0.19);
  EXPECT_TRUE(all.components[0].pass);
  EXPECT_EQ(all.components[2].value, -0.25);
  EXPECT_EQ(all.components[2].sigma, all.sigma);
  EXPECT_FALSE(all.components[2].pass);
  const LimitCheck one = Judge(calibration, "accelerometer.bias.x", Limit::Within(0.2));
  ASSERT_EQ(one.components.size(), 1u);
  EXPECT_EQ(one.components[0].outside, one.outside);
}

TEST(Limits, RefuseGainsAndBiasOfAMagnetometerWhoseFieldNobodyKnows) {
  Calibration calibration;
  calibration.sensors[Triad::kMagnetometer].emplace();
  calibration.reference.field_ut = 48.0;
  calibration.reference.field_nominal = true;
  PoseSet poses;
  StreamSummary& stream = poses.streams.emplace_back();
  stream.triad = Triad::kMagnetometer;
  stream.unit = {"uT", 1.0, false};
  for (const char* name :
       {"magnetometer.scale_error", "magnetometer.bias", "magnetometer.bias.y"}) {
    LimitOptions limits;
    limits.limits[name] = Limit::Within(0.05);
    const auto checks = JudgeLimits(calibration, poses, limits);
    ASSERT_FALSE(checks) << name;
    EXPECT_THAT(checks.error().message, ::testing::HasSubstr("the field strength is unknown"));
  }
}

TEST(Limits, JudgeTheAngleBetweenSensingAxes) {
  Calibration calibration = WithBias(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  const double angle = 0.02;
  sensor.model.sensitivity.row(1) = Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0.0);
  sensor.sensitivity_sigma(1, 0) = 0.001;
  const LimitCheck check =
      Judge(calibration, "accelerometer.non_orthogonality_rad", Limit::Within(0.05));
  EXPECT_EQ(check.component, "xy");
  EXPECT_NEAR(check.worst, angle, 1e-12);
  EXPECT_NEAR(check.sigma, 0.001, 1e-6);
}

TEST(Limits, HoldOverAllTemperaturesThatWereCalibrated) {
  Calibration calibration = WithBias({0.1, 0.0, 0.0}, Eigen::Vector3d::Zero());
  TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  ThermalTerms& thermal = sensor.thermal.emplace();
  thermal.reference_degc = 25.0;
  thermal.range_degc = {-15.0, 65.0};
  thermal.bias = {Eigen::Vector3d(-0.01, 0.0, 0.0)};
  const LimitCheck bias = Judge(calibration, "accelerometer.bias", Limit::Within(0.45));
  EXPECT_FALSE(bias.pass);
  EXPECT_NEAR(bias.worst, 0.5, 1e-9);  // 40 degC below the reference
  const LimitCheck slope = Judge(calibration, "accelerometer.bias_per_degc", Limit::Within(0.02));
  EXPECT_NEAR(slope.worst, -0.01, 1e-9);
  EXPECT_TRUE(slope.pass);
}

TEST(Limits, OfNamesThatAreNotKnownSayWhichAre) {
  const auto text = [](const std::string& name) {
    const auto parsed = ParseLimitName(name);
    return parsed ? std::string() : parsed.error().message;
  };
  EXPECT_THAT(text("accelerometer.offset"), testing::HasSubstr("known are bias, scale_error"));
  EXPECT_THAT(text("accelerometer.bias.w"), testing::HasSubstr("known are x, y, z"));
  EXPECT_THAT(text("accelerometer.residual_rms.x"), testing::HasSubstr("it is one number"));
  EXPECT_THAT(text("compass.bias"), testing::HasSubstr("reference.dip_deg"));
  for (const char* name : {"gyroscope.bias.z",
                           "magnetometer.misalignment_rad.xy",
                           "reference.field_ut",
                           "accelerometer.non_orthogonality_rad.xz"}) {
    EXPECT_EQ(text(name), "");
  }
  EXPECT_EQ(ParseLimitName("gyroscope.bias_per_degc")->Unit(), "rad/s/degC");
}

}  // namespace limits_test
}  // namespace truetriad
