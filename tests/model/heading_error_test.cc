// SPDX-License-Identifier: Apache-2.0
#include "model/heading_error.h"

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace heading_error_test {

constexpr double kGravity = 9.8, kField = 48.0, kDip = 1.1;

/// Accelerometer in m/s^2 and magnetometer in uT, ideal, known without σ.
Calibration IdealCompass() {
  Calibration calibration;
  calibration.reference.gravity_mps2 = kGravity;
  calibration.reference.field_ut = kField;
  calibration.reference.dip_rad = kDip;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    TriadCalibration sensor;
    sensor.input_unit = sensor.output_unit = triad == Triad::kAccelerometer ? "m/s^2" : "uT";
    calibration.sensors[triad] = sensor;
    const std::string name(TriadName(triad));
    for (const char axis : {'x', 'y', 'z'}) {
      calibration.covariance.parameters.push_back(name + ".bias." + axis);
    }
    for (const char row : {'x', 'y', 'z'}) {
      for (const char column : {'x', 'y', 'z'}) {
        calibration.covariance.parameters.push_back(name + ".sensitivity." + row + column);
      }
    }
  }
  calibration.covariance.matrix = Eigen::MatrixXd::Zero(24, 24);
  return calibration;
}

// Level, headed psi: the body's y axis is to the left, and a bias along it turns the horizontal
// field h (cos psi, sin psi) by atan(b cos psi / (h + b sin psi)).
TEST(HeadingError, OfHardIronIsThatOfTheHorizontalField) {
  Calibration calibration = IdealCompass();
  constexpr double kBias = 2.0;
  calibration.sensors[Triad::kMagnetometer]->model.bias = {0.0, kBias, 5.0};
  const double horizontal = kField * std::cos(kDip);
  const std::vector<HeadingError> errors = HeadingErrors(calibration, 12);
  ASSERT_EQ(errors.size(), 12U);
  for (const HeadingError& error : errors) {
    ASSERT_TRUE(error.raw_rad);
    const double psi = error.heading_rad;
    EXPECT_NEAR(*error.raw_rad,
                std::atan2(kBias * std::cos(psi), horizontal + kBias * std::sin(psi)),
                1e-12);
    EXPECT_EQ(error.sigma_rad, 0.0);
  }
}

// A level unit that reads a tilt t about its heading turns the vertical field into t tan(dip).
TEST(HeadingError, OfATiltGoesWithTheDip) {
  Calibration calibration = IdealCompass();
  constexpr double kTilt = 1e-4;
  calibration.sensors[Triad::kAccelerometer]->model.bias = {0.0, kTilt * kGravity, 0.0};
  const HeadingError north = HeadingErrors(calibration, 4).front();
  EXPECT_NEAR(std::abs(*north.raw_rad), kTilt * std::tan(kDip), 1e-3 * kTilt);
}

// Against calibrations drawn from a covariance of both sensors.
TEST(HeadingError, IsWhatCalibrationsOfThisCovarianceLeave) {
  Calibration calibration = IdealCompass();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root(24, 24);
  for (double& entry : root.reshaped()) entry = 1e-4 * normal(random);
  calibration.covariance.matrix = root * root.transpose();
  const HeadingError expected = HeadingErrors(calibration, 8)[3];
  const double horizontal = kField * std::cos(kDip);
  const Eigen::Vector3d force(0.0, 0.0, kGravity);
  const Eigen::Vector3d field(horizontal * std::cos(expected.heading_rad),
                              horizontal * std::sin(expected.heading_rad),
                              -kField * std::sin(kDip));
  constexpr int kDraws = 20000;
  double squares = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd z(24);
    for (double& entry : z) entry = normal(random);
    const Eigen::VectorXd off = root * z;
    const auto corrected = [&](Eigen::Index first, const Eigen::Vector3d& truth) {
      TriadModel<double> model;
      model.bias = off.segment<3>(first);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) model.sensitivity(i, j) += off[first + 3 + 3 * i + j];
      }
      return model.TruthFromRaw(truth);
    };
    const Eigen::Vector3d up = corrected(0, force).normalized();
    const Eigen::Vector3d read = corrected(12, field);
    const Eigen::Vector3d north = (read - read.dot(up) * up).normalized();
    const double heading = std::atan2(-up.cross(north).x(), north.x());
    const double error = std::remainder(heading - expected.heading_rad, 2.0 * std::numbers::pi);
    squares += error * error;
  }
  // σ of the RMS of n draws: 1 / sqrt(2 n); four of it.
  EXPECT_NEAR(std::sqrt(squares / kDraws) / expected.sigma_rad, 1.0, 4.0 / std::sqrt(2.0 * kDraws));
}

TEST(HeadingError, NeedsACompass) {
  Calibration calibration = IdealCompass();
  calibration.reference.dip_rad.reset();
  EXPECT_TRUE(HeadingErrors(calibration, 4).empty());
  calibration = IdealCompass();
  calibration.sensors[Triad::kMagnetometer].reset();
  EXPECT_TRUE(HeadingErrors(calibration, 4).empty());
  calibration = IdealCompass();
  calibration.sensors[Triad::kMagnetometer]->input_unit = "counts";
  EXPECT_FALSE(HeadingErrors(calibration, 4).front().raw_rad);
}

}  // namespace heading_error_test
}  // namespace truetriad
