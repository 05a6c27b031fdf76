// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "verdict/quality.h"

namespace truetriad {
namespace {

// A bias whose axes have the values and σ given, in m/s².
Calibration WithBias(const Eigen::Vector3d& bias, const Eigen::Vector3d& sigma) {
  Calibration calibration;
  TriadCalibration& sensor = calibration.sensors[Triad::kAccelerometer].emplace();
  sensor.model.bias = bias;
  sensor.bias_sigma = sigma;
  return calibration;
}

LimitCheck JudgeBias(const Calibration& calibration, double limit, double k) {
  LimitOptions limits;
  limits.limits["accelerometer.bias"] = limit;
  limits.guard_band_k = k;
  const auto checks = JudgeLimits(calibration, PoseSet(), limits);
  EXPECT_TRUE(checks);
  EXPECT_EQ(checks->size(), 1U);
  return checks->front();
}

TEST(Limits, GuardBandIsThatOfTheAxisWhichComesNearest) {
  // y is the largest value, x with its σ the nearest to the limit.
  const Calibration calibration = WithBias({0.0003, 0.002, 0.0}, {0.0064, 0.0001, 0.0001});
  EXPECT_TRUE(JudgeBias(calibration, 0.011, 0.0).pass);
  EXPECT_EQ(JudgeBias(calibration, 0.011, 0.0).worst, 0.002);
  const LimitCheck guarded = JudgeBias(calibration, 0.011, 2.0);
  EXPECT_FALSE(guarded.pass);
  EXPECT_EQ(guarded.worst, 0.0003);
  EXPECT_EQ(guarded.sigma, 0.0064);
  EXPECT_TRUE(JudgeBias(calibration, 0.0132, 2.0).pass);
}

}  // namespace
}  // namespace truetriad
