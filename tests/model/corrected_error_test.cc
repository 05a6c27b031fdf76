// SPDX-License-Identifier: Apache-2.0
#include "model/corrected_error.h"

#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace truetriad {
namespace corrected_error_test {

constexpr double kGravity = 9.8;

/// Of an accelerometer in m/s^2 that is known without σ.
Calibration Known() {
  Calibration calibration;
  TriadCalibration sensor;
  sensor.input_unit = sensor.output_unit = "m/s^2";
  sensor.model.bias = {0.3, -0.1, 0.2};
  sensor.model.sensitivity << 1.01, 0.0, 0.0, 0.004, 0.99, 0.0, -0.006, 0.003, 1.02;
  calibration.sensors[Triad::kAccelerometer] = sensor;
  for (const char axis : {'x', 'y', 'z'}) {
    calibration.covariance.parameters.push_back(std::string("accelerometer.bias.") + axis);
  }
  for (const char row : {'x', 'y', 'z'}) {
    for (const char column : {'x', 'y', 'z'}) {
      calibration.covariance.parameters.push_back(std::string("accelerometer.sensitivity.") + row +
                                                  column);
    }
  }
  calibration.covariance.matrix = Eigen::MatrixXd::Zero(12, 12);
  return calibration;
}

// Mean squares over the sphere: of the bias, and a third of the squares of the matrix.
TEST(CorrectedError, OfRawReadingsIsBiasAndGainsOverTheSphere) {
  const Calibration calibration = Known();
  const CorrectedError error = CorrectedErrorOf(calibration, Triad::kAccelerometer, kGravity);
  const TriadModel<double>& model = calibration.sensors[Triad::kAccelerometer]->model;
  const Eigen::Matrix3d off = model.sensitivity - Eigen::Matrix3d::Identity();
  ASSERT_TRUE(error.before);
  EXPECT_NEAR(error.before->rms,
              std::sqrt(model.bias.squaredNorm() + kGravity * kGravity * off.squaredNorm() / 3.0),
              1e-3);
  EXPECT_GT(error.before->worst, error.before->rms);
  EXPECT_LT(error.before->worst, model.bias.norm() + kGravity * off.norm());
  EXPECT_EQ(error.after.rms, 0.0);
  const CorrectedError at_rest = CorrectedErrorOf(calibration, Triad::kAccelerometer, 0.0);
  EXPECT_NEAR(at_rest.before->rms, model.bias.norm(), 1e-12);
  EXPECT_EQ(at_rest.before->angle_rms, 0.0);
}

// A bias of many times what is read turns readings all over the half sphere it is in: by 90 degrees
// in the mean of squares and a little more, never beyond 180.
TEST(CorrectedError, OfRawDirectionsIsAnAngle) {
  Calibration calibration = Known();
  calibration.sensors[Triad::kAccelerometer]->model.bias = {1e4, 0.0, 0.0};
  const CorrectedError error = CorrectedErrorOf(calibration, Triad::kAccelerometer, kGravity);
  // All read x: the angle to it is a, sin(a) / 2 of the sphere: the mean square is pi^2 / 2 - 2.
  constexpr double kPi = 3.14159265358979;
  EXPECT_NEAR(error.before->angle_rms, std::sqrt(kPi * kPi / 2.0 - 2.0), 0.01);
  EXPECT_LE(error.before->angle_worst, kPi);
}

// Against calibrations drawn from the covariance, each applied to readings in random directions.
TEST(CorrectedError, IsWhatCalibrationsOfThisCovarianceLeave) {
  Calibration calibration = Known();
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root(12, 12);
  for (double& entry : root.reshaped()) entry = 1e-4 * normal(random);
  root.topRows(3) *= 5.0;
  calibration.covariance.matrix = root * root.transpose();
  const TriadModel<double>& truth = calibration.sensors[Triad::kAccelerometer]->model;
  constexpr int kDraws = 20000;
  double square = 0.0, across = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd white(12);
    for (double& entry : white) entry = normal(random);
    const Eigen::VectorXd change = root * white;
    TriadModel<double> found = truth;
    found.bias += change.head(3);
    found.sensitivity +=
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(change.data() + 3);
    const Eigen::Vector3d u =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Eigen::Vector3d raw = truth.sensitivity * (kGravity * u) + truth.bias;
    const Eigen::Vector3d off = found.sensitivity.inverse() * (raw - found.bias) - kGravity * u;
    square += off.squaredNorm() / kDraws;
    across += (off - off.dot(u) * u).squaredNorm() / (kGravity * kGravity) / kDraws;
  }
  const CorrectedError error = CorrectedErrorOf(calibration, Triad::kAccelerometer, kGravity);
  // A mean of so many squares, each of a few degrees of freedom, is known to about 1 %.
  EXPECT_NEAR(error.after.rms / std::sqrt(square), 1.0, 0.02);
  EXPECT_NEAR(error.after.angle_rms / std::sqrt(across), 1.0, 0.02);
}

TEST(CorrectedError, HasNoRawOneOfCounts) {
  Calibration calibration = Known();
  calibration.sensors[Triad::kAccelerometer]->input_unit = "counts";
  EXPECT_FALSE(CorrectedErrorOf(calibration, Triad::kAccelerometer, kGravity).before);
}

}  // namespace corrected_error_test
}  // namespace truetriad
