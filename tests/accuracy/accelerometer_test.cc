// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accuracy/shared_recordings.h"

namespace truetriad {
namespace accelerometer_test {

using ::testing::HasSubstr;

class AccelerometerRecordings : public SharedRecordings {};

double ResidualRms(const Outcomes& outcomes) {
  return outcomes.calibration.quality.residual_rms[Triad::kAccelerometer].value_or(
      std::numeric_limits<double>::infinity());
}

// The known answer is an equal-weight fit to the first second of each rest; ours weighs whole
// rests, so the two differ by about √2 of our σ.
TEST_F(AccelerometerRecordings, XsensInRawCountsGivesTheKnownAnswerWithoutStartValues) {
  const Outcomes run = Run("xsens-imu-tk", Manifest("xsens-imu-tk"));
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const Calibration& calibration = run.calibration;
  EXPECT_EQ(calibration.inputs.at(0).samples, 51175);
  EXPECT_NEAR(calibration.quality.poses, 38, 2);
  EXPECT_LE(ResidualRms(run), 1.1e-3);

  const CorrectionEstimate estimate = CorrectionOf(calibration, Triad::kAccelerometer);
  const Eigen::Matrix3d C = estimate.values.tail<9>().reshaped(3, 3);
  const auto expect = [&](const std::string& name,
                          double value,
                          double known,
                          const Eigen::Matrix<double, 12, 1>& derivative) {
    const double sigma = std::sqrt(derivative.dot(estimate.covariance * derivative));
    EXPECT_NEAR(value, known, 3.0 * std::numbers::sqrt2 * sigma) << name << ", σ " << sigma;
    return sigma;
  };
  using Derivative = Eigen::Matrix<double, 12, 1>;
  const auto entry = [](int row, int column) { return 3 + 3 * column + row; };
  const Eigen::Vector3d known_bias(33124.18, 33275.18, 32364.42);
  const Eigen::Vector3d known_gain(414.459, 412.010, 414.649);
  for (int axis = 0; axis < 3; ++axis) {
    expect("bias", estimate.values[axis], known_bias[axis], Derivative::Unit(axis));
    const double gain = 1.0 / C(axis, axis);
    const double sigma =
        expect("gain", gain, known_gain[axis], -gain * gain * Derivative::Unit(entry(axis, axis)));
    EXPECT_GT(sigma / gain, 25e-6);
    EXPECT_LT(sigma / gain, 90e-6);
  }
  // C = T K with K = diag(C): T_ij = C_ij / C_jj.
  const auto expect_misalignment = [&](const std::string& name, int row, int column, double known) {
    const double value = C(row, column) / C(column, column);
    const Derivative derivative =
        (Derivative::Unit(entry(row, column)) - value * Derivative::Unit(entry(column, column))) /
        C(column, column);
    expect(name, value, known, derivative);
  };
  expect_misalignment("-alpha_yz", 0, 1, -0.003359);
  expect_misalignment("alpha_zy", 0, 2, -0.008906);
  expect_misalignment("-alpha_zx", 1, 2, -0.021334);
}

TEST_F(AccelerometerRecordings, EachMpu9150FitsItsTwentyTwoRests) {
  for (const std::string unit : {"imu0", "imu1", "imu2"}) {
    SCOPED_TRACE(unit);
    const Outcomes run = Run("mpu9150", Manifest("mpu9150-" + unit));
    ASSERT_EQ(run.exit_code, 0) << run.text;
    EXPECT_EQ(run.calibration.quality.poses, 22);
    EXPECT_LE(ResidualRms(run), 0.0020);
    EXPECT_TRUE(Agrees(run.calibration,
                       Triad::kAccelerometer,
                       ReadReferenceFit(File("a-mpu9150-22pose/reference.json"), {unit}),
                       9.81));
  }
}

TEST_F(AccelerometerRecordings, BlocksOfAHundredRowsGiveThe160PosesOfCk) {
  const Outcomes run = Run("ck-accelerometer", Manifest("ck-accelerometer"));
  ASSERT_EQ(run.exit_code, 0) << run.text;
  EXPECT_EQ(run.calibration.quality.poses, 160);
  const ReferenceFit fit =
      ReadReferenceFit(File("a-ck-160pose-and-accmag-tumble/reference.json"), {"acc_log"});
  EXPECT_TRUE(Agrees(run.calibration, Triad::kAccelerometer, fit, 9.80665));
  // The reference minimises the plain RMS; other weights on 160 poses and nine parameters cost at
  // most the parameters' share of it, 9/160.
  EXPECT_LE(ResidualRms(run), (1.0 + 9.0 / 160.0) * fit.rms_after * 9.80665);
}

TEST_F(AccelerometerRecordings, AQuantisedPhoneIsNoWorseThanTheReferenceFit) {
  if (!MakeTables()) GTEST_SKIP() << "no python3 to convert the .mat file with";
  const Outcomes run = Run("phone-lis3dh", Manifest("phone-lis3dh"));
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const ReferenceFit fit = ReadReferenceFit(File("a-phone-lis3dh-34pose/reference.json"), {});
  EXPECT_TRUE(Agrees(run.calibration, Triad::kAccelerometer, fit, 9.81));
  EXPECT_LE(ResidualRms(run), fit.rms_after);
}

TEST_F(AccelerometerRecordings, TenPosesForNineParametersAreNotPraisedForTheirSmallResidual) {
  const Outcomes run = Run("mpu6050-minimal", Manifest("mpu6050-minimal"));
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const Calibration& calibration = run.calibration;
  EXPECT_EQ(calibration.quality.poses, 10);
  EXPECT_EQ(calibration.quality.dof, 1.0);
  EXPECT_LT(calibration.quality.effective_dof, 2.0);
  ASSERT_FALSE(calibration.quality.weak_directions.empty());
  EXPECT_THAT(calibration.quality.weak_directions[0].description, HasSubstr("misalignment yx"));
  // The author's biases, stated as numbers to add; his fit is of another method.
  const TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  const Eigen::Vector3d author(711.516, -358.505, -1840.128);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(
        sensor.model.bias[axis], author[axis], 3.0 * std::numbers::sqrt2 * sensor.bias_sigma[axis]);
  }
  EXPECT_THAT(run.text, HasSubstr("only 1.0 degrees of freedom support σ"));
}

TEST_F(AccelerometerRecordings, SixKnownFacesDetermineWhatSixNormsDoNot) {
  const std::string manifest = Manifest("ferraris");
  const Outcomes norms = Run("ferraris", manifest, "attitudes=none,gauge=accel-x");
  EXPECT_EQ(norms.exit_code, 3) << norms.text;

  const Outcomes run = Run("ferraris", manifest);
  ASSERT_EQ(run.exit_code, 0) << run.text;
  const Calibration& calibration = run.calibration;
  EXPECT_EQ(calibration.quality.poses, 6);
  // Half the difference and the mean of the two rests of each axis, from the set's README, which
  // rounds to 0.5e-3 m/s^2; tilts of 0.5 deg shorten the axis by 4e-5 of 9.81 m/s^2.
  const TriadModel<double>& model = calibration.sensors[Triad::kAccelerometer]->model;
  const Eigen::Vector3d up(10.314, 9.217, 10.437);
  const Eigen::Vector3d down(-9.24, -10.45, -9.64);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(model.sensitivity(axis, axis), (up - down)[axis] / (2.0 * 9.81), 2e-4);
  }
  // Each misalignment rests on the tilts of two opposite faces of 0.5 deg, averaged.
  const double tilt_rad = 0.5 / std::numbers::sqrt2 * std::numbers::pi / 180.0;
  EXPECT_NEAR(
      calibration.sensors[Triad::kAccelerometer]->sensitivity_sigma(0, 1) / model.sensitivity(0, 0),
      tilt_rad,
      0.1 * tilt_rad);
}

TEST_F(AccelerometerRecordings, TooFewDirectionsForNineParametersAreEnoughForSix) {
  if (!MakeTables()) GTEST_SKIP() << "no python3 to convert the JSON files with";
  const Outcomes full =
      Run("krepa-accelerometer", Table("krepa_accel_1"), "sensors.accelerometer.model=full");
  EXPECT_EQ(full.exit_code, 3) << full.text;
  ASSERT_FALSE(full.calibration.quality.weak_directions.empty());
  // How much of scale x goes with this misalignment depends on where in the flat valley the
  // optimiser gave up.
  EXPECT_THAT(full.calibration.quality.weak_directions[0].description,
              HasSubstr("misalignment yx"));

  const Outcomes diagonal = Run("krepa-accelerometer", Table("krepa_accel_1"));
  ASSERT_EQ(diagonal.exit_code, 0) << diagonal.text;
  EXPECT_EQ(diagonal.calibration.quality.poses, 667 - 2);  // two rows repeat others
  // A thirtieth of the spread before, 0.155 m/s^2: the six parameters explain the readings.
  EXPECT_LT(ResidualRms(diagonal), 0.155 / 30.0);
}

}  // namespace accelerometer_test
}  // namespace truetriad
