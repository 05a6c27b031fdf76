// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "accuracy/shared_recordings.h"

namespace truetriad {
namespace {

constexpr Triad kGyro = Triad::kGyroscope;

class GyroscopeRecordings : public SharedRecordings {};

double AngleDeg(const Outcomes& run) {
  return 180.0 / std::numbers::pi * run.calibration.quality.residual_rms[kGyro].value_or(1e9);
}

// The known answer was made without g-sensitivity, by predicting the direction of gravity.
TEST_F(GyroscopeRecordings, XsensInRawCountsGivesTheKnownAnswerWithoutStartValues) {
  const Outcomes run = Run(
      "xsens-imu-tk-pair", Manifest("xsens-imu-tk-pair"), "sensors.gyroscope.g_sensitivity=false");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const CorrectionEstimate estimate = CorrectionOf(run.calibration, kGyro);
  const Eigen::Matrix3d C = estimate.values.tail<9>().reshaped(3, 3);
  using Derivative = Eigen::Matrix<double, 12, 1>;
  const auto expect = [&](double value, double known, const Derivative& derivative) {
    const double sigma = std::sqrt(derivative.dot(estimate.covariance * derivative));
    EXPECT_NEAR(value, known, 3.0 * sigma) << "sigma " << sigma;
  };
  const auto entry = [](int row, int column) { return 3 + 3 * column + row; };
  const Eigen::Vector3d known_gain(4778.62, 4763.86, 4771.68);
  const Eigen::Vector3d factory_gain(4778.0, 4758.0, 4766.0);
  const Eigen::Vector3d known_bias(32771.09, 32458.41, 32513.31);
  for (int axis = 0; axis < 3; ++axis) {
    const double gain = 1.0 / C(axis, axis);
    expect(gain, known_gain[axis], -gain * gain * Derivative::Unit(entry(axis, axis)));
    EXPECT_NEAR(gain / factory_gain[axis], 1.0, 0.0025);
    EXPECT_NEAR(estimate.values[axis], known_bias[axis], 8.0);
  }
  // C = T K with K = diag(C).
  Eigen::Matrix3d known;
  known << 1.0, 0.005936, 0.001111, 0.008088, 1.0, -0.053557, 0.025307, -0.002551, 1.0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (row == column) continue;
      const double value = C(row, column) / C(column, column);
      expect(
          value,
          known(row, column),
          (Derivative::Unit(entry(row, column)) - value * Derivative::Unit(entry(column, column))) /
              C(column, column));
    }
  }
}

TEST_F(GyroscopeRecordings, XsensFollowsGravityAndSaysSo) {
  const Outcomes without = Run(
      "xsens-imu-tk-pair", Manifest("xsens-imu-tk-pair"), "sensors.gyroscope.g_sensitivity=false");
  const Outcomes with = Run("xsens-imu-tk-pair", Manifest("xsens-imu-tk-pair"));
  ASSERT_EQ(with.exit_code, 0) << with.text;
  EXPECT_EQ(with.calibration.quality.poses, 38);
  EXPECT_TRUE(with.calibration.sensors[kGyro]->g_sensitivity.has_value());
  EXPECT_LT(AngleDeg(with), 0.3 * AngleDeg(without));
  EXPECT_LT(AngleDeg(with), 0.12);
}

// Of all that could be there the unit has the g-sensitivity, by far, and nothing else.
TEST_F(GyroscopeRecordings, XsensIsFoundToFollowGravity) {
  const Outcomes run = Run("xsens-imu-tk-pair",
                           Manifest("xsens-imu-tk-pair"),
                           "sensors.accelerometer.model=auto,sensors.gyroscope.model=auto,"
                           "sensors.gyroscope.g_sensitivity=auto");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  EXPECT_TRUE(run.calibration.sensors[kGyro]->g_sensitivity.has_value());
  EXPECT_FALSE(run.calibration.sensors[kGyro]->asymmetry_sigma.has_value());
  EXPECT_FALSE(run.calibration.sensors[Triad::kAccelerometer]->quadratic_sigma.has_value());
  ASSERT_FALSE(run.calibration.quality.model_choice.empty());
  for (const ModelAlternative& model : run.calibration.quality.model_choice) {
    if (model.description != "gyroscope without g-sensitivity") continue;
    EXPECT_LT(*model.p_value, 1e-6);
  }
}

// Three units of one kind, each turned by hand.
TEST_F(GyroscopeRecordings, EachMpu9150PredictsGravityAfterATurn) {
  for (const std::string unit : {"imu0", "imu1", "imu2"}) {
    SCOPED_TRACE(unit);
    const Outcomes run = Run("mpu9150-gyroscope", Manifest("mpu9150-" + unit));
    ASSERT_EQ(run.exit_code, 0) << run.text;
    RecordProperty(unit + "_angle_deg", std::to_string(AngleDeg(run)));
    EXPECT_LT(AngleDeg(run), 0.3);
  }
}

}  // namespace
}  // namespace truetriad
