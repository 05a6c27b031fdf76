// SPDX-License-Identifier: Apache-2.0
//
// Magnetometer and gyroscope without accelerometer: turns are measured against the field, and the
// magnetometer leads the body frame.

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/distributions.h"
#include "support/accel_mag_trials.h"
#include "support/finding_matchers.h"
#include "support/synthetic_poses.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/model/calibration.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace field_turns_test {

using ::testing::Contains;
using ::testing::Not;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;

// `map`: how the magnetometer is mounted; the unit is stated in the magnetometer's frame.
SyntheticUnit DrawFieldUnit(const Eigen::Matrix3d& map, Random* random) {
  SyntheticUnit unit = trials::RandomUnit({}, random);
  unit.models[kAccel].reset();
  TriadModel<double>& magnetometer = *unit.models[kMag];
  magnetometer.sensitivity *= GaugeRotation(Gauge::kAccelX, magnetometer.sensitivity) * map;
  TriadModel<double>& gyroscope = unit.models[kGyro].emplace();
  gyroscope.sensitivity = Eigen::Matrix3d::Identity() +
                          0.02 * Eigen::Matrix3d::NullaryExpr([&] { return random->Normal(); });
  gyroscope.bias = 0.05 * random->Normal3();
  unit.units[kGyro] = {"rad/s", 1.0, false};
  return unit;
}

PoseSet RecordFieldTurns(const SyntheticUnit& unit, double noise, Random* random) {
  SyntheticNoise rest;
  rest.rest_sigma[kMag] = noise * 0.05;
  rest.rest_sigma[kGyro] = noise * 1e-4;
  SyntheticTurns turns;
  turns.gyroscope_sigma_radps = noise * 2e-3;
  turns.magnetometer_sigma_ut = noise * 0.3;
  const auto attitudes = RandomAttitudes(24, random);
  PoseSet set = SimulatePoses(unit, attitudes, rest, random);
  AddTurns(unit, attitudes, turns, noise > 0.0 ? random : nullptr, &set);
  return set;
}

CalibrateOptions OptionsOfFieldUnit(const SyntheticUnit& unit) {
  CalibrateOptions options;
  options.triads[kMag].enabled = options.triads[kGyro].enabled = true;
  options.triads[kMag].excess = options.triads[kGyro].excess = ExcessNoise::kNone;
  options.triads[kGyro].mounting = Eigen::Matrix3d::Identity();
  options.reference.field_ut = {unit.field_ut, 0.0};
  options.cross_validation_folds = 0;
  return options;
}

class MagnetometerMounted : public ::testing::TestWithParam<const char*> {
 protected:
  Eigen::Matrix3d map() const { return *AxisMapFromName(GetParam()); }
};

// Exact up to the nominal noise by which readings without noise are weighed.
TEST_P(MagnetometerMounted, IsFoundExactlyWithTheGyroscope) {
  Random random(1);
  const SyntheticUnit unit = DrawFieldUnit(map(), &random);
  const auto summary = Calibrate(RecordFieldTurns(unit, 0.0, &random), OptionsOfFieldUnit(unit));
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable());
  EXPECT_EQ(summary->calibration.gauge_sensor, kMag);
  EXPECT_FALSE(summary->calibration.reference.dip_rad);
  for (const Triad triad : {kMag, kGyro}) {
    const TriadModel<double>& found = summary->calibration.sensors[triad]->model;
    const TriadModel<double>& truth = *unit.models[triad];
    const double gain = truth.sensitivity.norm();
    const double strength = triad == kGyro ? 1.0 : unit.field_ut;
    EXPECT_LT((found.sensitivity - truth.sensitivity).norm(), 1e-6 * gain) << TriadName(triad);
    EXPECT_LT((found.bias - truth.bias).norm(), 1e-6 * gain * strength) << TriadName(triad);
  }
  const auto& findings = summary->calibration.findings;
  if (map().isIdentity(0.0)) {
    EXPECT_THAT(findings, Not(Contains(HasCode(FindingCode::kMountingFound))));
  } else {
    EXPECT_THAT(findings, Contains(HasCode(FindingCode::kMountingFound)));
  }
}

INSTANTIATE_TEST_SUITE_P(InEachWay,
                         MagnetometerMounted,
                         ::testing::Values("+x+y+z", "+y+x-z", "-z+x-y"));

TEST(FieldTurns, HaveNeesAsTheirCovarianceSays) {
  Random random(2);
  double sum = 0.0;
  int dimension = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const SyntheticUnit unit = DrawFieldUnit(Eigen::Matrix3d::Identity(), &random);
    const auto summary = Calibrate(RecordFieldTurns(unit, 1.0, &random), OptionsOfFieldUnit(unit));
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    int size = 0;
    sum += trials::Nees(
        trials::Errors(summary->calibration, unit), summary->calibration.covariance.matrix, &size);
    EXPECT_EQ(size, 21);  // three entries are the gauge
    dimension += size;
  }
  // χ² with `dimension` degrees of freedom, 1 in 10 000 on each side.
  EXPECT_GT(ChiSquareCdf(sum, dimension), 1e-4) << sum << " of " << dimension;
  EXPECT_LT(ChiSquareCdf(sum, dimension), 1.0 - 1e-4) << sum << " of " << dimension;
}

TEST(FieldTurns, AreEvaluatedByTheField) {
  Random random(3);
  const SyntheticUnit unit = DrawFieldUnit(Eigen::Matrix3d::Identity(), &random);
  const auto summary = Calibrate(RecordFieldTurns(unit, 1.0, &random), OptionsOfFieldUnit(unit));
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const auto evaluation = Evaluate(summary->calibration, RecordFieldTurns(unit, 1.0, &random));
  ASSERT_TRUE(evaluation) << evaluation.error().message;
  ASSERT_TRUE(evaluation->turns);
  EXPECT_EQ(evaluation->turns->against, kMag);
  EXPECT_EQ(evaluation->turns->count, 23);
  // Of 23 turns RMS over prediction scatters by 1 / sqrt(2 * 2 * 23) = 0.1; the limit is five σ.
  EXPECT_NEAR(evaluation->turns->rms_rad / evaluation->turns->predicted_rms_rad, 1.0, 0.5);
}

TEST(FieldTurns, RefuseDegreesLabelledRadians) {
  Random random(4);
  const SyntheticUnit unit = DrawFieldUnit(Eigen::Matrix3d::Identity(), &random);
  PoseSet poses = RecordFieldTurns(unit, 1.0, &random);
  for (RecordedMove& move : poses.moves) {
    for (Eigen::Vector3d& raw : move.gyroscope_raw) raw *= 180.0 / M_PI;
  }
  for (StaticPose& pose : poses.poses) pose.triads[kGyro]->mean_raw *= 180.0 / M_PI;
  // The finding needs the middle of the range of readings, here of those of the poses.
  for (StreamSummary& stream : poses.streams) {
    if (stream.triad != kMag) continue;
    stream.minimum_raw.setConstant(1e9);
    stream.maximum_raw.setConstant(-1e9);
    for (const StaticPose& pose : poses.poses) {
      stream.minimum_raw = stream.minimum_raw.cwiseMin(pose.triads[kMag]->mean_raw).eval();
      stream.maximum_raw = stream.maximum_raw.cwiseMax(pose.triads[kMag]->mean_raw).eval();
    }
  }
  const auto summary = Calibrate(poses, OptionsOfFieldUnit(unit));
  ASSERT_TRUE(summary);
  EXPECT_THAT(summary->calibration.findings, Contains(HasCode(FindingCode::kWrongUnit)));
}

}  // namespace field_turns_test
}  // namespace truetriad
