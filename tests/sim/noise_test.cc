// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "sim/scenario_samples.h"
#include "sim/sensor.h"

namespace truetriad {
namespace noise_test {

constexpr double kRateHz = 50.0;

SimulatedTriad NoisyTriad() {
  SimulatedTriad triad;
  triad.sampling.rate_hz = kRateHz;
  triad.nominal.sensitivity.diagonal() << 10.0, -20.0, 40.0;  // Counts per unit.
  return triad;
}

TEST(NoiseProcess, WhiteNoiseHasItsDensityTimesTheRootOfTheRate) {
  SimulatedTriad triad = NoisyTriad();
  triad.noise.density << 0.1, 0.2, 0.0;
  NoiseProcess noise(triad, 1, 0, Triad::kAccelerometer);
  constexpr int kCount = 200'000;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double product = 0.0;
  double last = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d x = noise.Next();
    squares += x.cwiseAbs2() / kCount;
    product += last * x[0] / kCount;
    last = x[0];
  }
  const Eigen::Vector3d variance =
      kRateHz * Eigen::Vector3d(10.0 * 0.1, 20.0 * 0.2, 0.0).cwiseAbs2();
  // Four sigma: sqrt(2 / n) of a variance, sqrt(1 / n) of a correlation.
  EXPECT_NEAR(squares[0] / variance[0], 1.0, 4.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(squares[1] / variance[1], 1.0, 4.0 * std::sqrt(2.0 / kCount));
  EXPECT_EQ(squares[2], 0.0);
  EXPECT_NEAR(product / variance[0], 0.0, 4.0 / std::sqrt(kCount));
}

TEST(NoiseProcess, BiasInstabilityIsStationaryAndForgetsWithItsTime) {
  SimulatedTriad triad = NoisyTriad();
  triad.noise.instability_sigma << 0.3, 0.0, 0.0;
  triad.noise.correlation_time_s = 2.0;
  constexpr int kRuns = 4000;
  constexpr int kSteps = 100;  // One correlation time.
  double start = 0.0;
  double end = 0.0;
  double product = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    NoiseProcess noise(triad, static_cast<std::uint64_t>(run), 0, Triad::kGyroscope);
    const double first = noise.Next()[0];
    double last = first;
    for (int i = 0; i < kSteps; ++i) last = noise.Next()[0];
    start += first * first / kRuns;
    end += last * last / kRuns;
    product += first * last / kRuns;
  }
  const double variance = std::pow(10.0 * 0.3, 2);
  EXPECT_NEAR(start / variance, 1.0, 4.0 * std::sqrt(2.0 / kRuns));
  EXPECT_NEAR(end / variance, 1.0, 4.0 * std::sqrt(2.0 / kRuns));
  // The variance of a product of two normals with correlation c is 1 + c^2.
  const double correlation = std::exp(-1.0);
  EXPECT_NEAR(
      product / variance, correlation, 4.0 * std::sqrt((1.0 + correlation * correlation) / kRuns));
}

TEST(NoiseProcess, RandomWalkStartsAtZeroAndGrowsWithTheRootOfTime) {
  SimulatedTriad triad = NoisyTriad();
  triad.noise.random_walk << 0.5, 0.0, 0.0;
  constexpr int kRuns = 4000;
  constexpr int kSteps = 200;  // Four seconds.
  double end = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    NoiseProcess noise(triad, static_cast<std::uint64_t>(run), 0, Triad::kGyroscope);
    ASSERT_EQ(noise.Next()[0], 0.0);
    double last = 0.0;
    for (int i = 0; i < kSteps; ++i) last = noise.Next()[0];
    end += last * last / kRuns;
  }
  EXPECT_NEAR(end / (std::pow(10.0 * 0.5, 2) * 4.0), 1.0, 4.0 * std::sqrt(2.0 / kRuns));
}

TEST(ReadingDecimals, AreThoseOfTheResolutionOrATwentiethOfTheNoise) {
  EXPECT_EQ(ReadingDecimals(1.0, 5.0), 0);
  EXPECT_EQ(ReadingDecimals(0.1, 0.0), 1);
  EXPECT_EQ(ReadingDecimals(0.25, 0.0), 2);
  EXPECT_EQ(ReadingDecimals(1.0 / 2048.0, 0.0), 5);
  EXPECT_EQ(ReadingDecimals(0.0, 0.02), 3);
  EXPECT_EQ(ReadingDecimals(0.0, 0.019), 4);
  EXPECT_EQ(ReadingDecimals(0.0, 50.0), 0);
  EXPECT_EQ(ReadingDecimals(0.0, 0.0), RecordingFormat::kShortest);
}

TEST(SimulatedSensor, ReadingsAreMultiplesOfTheResolutionWithinTheRange) {
  Scenario scenario = StillScenario(20.0);
  SimulatedTriad& accelerometer = *scenario.sensors[Triad::kAccelerometer];
  accelerometer.resolution_raw = 0.25;
  accelerometer.range_raw = Eigen::Vector2d(-11.0, 10.75);
  accelerometer.noise.density.setConstant(0.1);
  double most = 0.0;
  for (const Eigen::Vector3d& reading : SamplesOf(scenario, Triad::kAccelerometer).readings) {
    for (const double value : reading) {
      EXPECT_EQ(value * 4.0, std::round(value * 4.0));
      EXPECT_LE(value, 10.75);
      most = std::max(most, value);
    }
  }
  EXPECT_EQ(most, 10.75);  // At rest 9.8 * 1.01 + 0.3; a noise of sigma 1 goes beyond it.
}

}  // namespace noise_test
}  // namespace truetriad
