// SPDX-License-Identifier: Apache-2.0
//
// Attitudes in a fixture that stands in the world in an unknown way.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/dense/cholesky.h"
#include "math/distributions.h"
#include "math/random.h"
#include "support/synthetic_poses.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace fixture_test {

using ::testing::HasSubstr;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kMag = Triad::kMagnetometer;
constexpr int kPoses = 24;

SyntheticUnit Unit() {
  SyntheticUnit unit;
  unit.models[kAccel].emplace();
  unit.models[kAccel]->sensitivity << 1.02, 0.03, -0.02, 0.01, 0.98, 0.04, -0.005, 0.02, 1.01;
  unit.models[kAccel]->bias << 0.1, -0.2, 0.3;
  unit.models[kMag].emplace();
  unit.models[kMag]->sensitivity << 0.02, 1.05, -0.01, 0.95, 0.03, 0.02, 0.0, -0.02, 1.04;
  unit.models[kMag]->bias << 5.0, -8.0, 12.0;
  for (const Triad triad : {kAccel, kMag}) {
    unit.units[triad] = *ParseTriadUnit(triad, TruthUnitName(triad));
  }
  return unit;
}

// Poses whose attitudes a fixture states, with an error of `sigma_rad`; the fixture stands in the
// world as `fixture_from_world` says.
PoseSet InFixture(const SyntheticUnit& unit,
                  const Eigen::Quaterniond& fixture_from_world,
                  double sigma_rad,
                  const SyntheticNoise& noise,
                  Random* random) {
  const std::vector<Eigen::Quaterniond> attitudes = RandomAttitudes(kPoses, random);
  PoseSet poses = SimulatePoses(unit, attitudes, noise, random);
  for (std::size_t k = 0; k < attitudes.size(); ++k) {
    AttitudeReference& stated = poses.poses[k].attitude.emplace();
    stated.world_from_body = fixture_from_world * attitudes[k] *
                             RotationExp(Eigen::Vector3d(sigma_rad * random->Normal3()));
    stated.sigma_rad.setConstant(sigma_rad);
  }
  return poses;
}

CalibrateOptions OptionsFor(const SyntheticUnit& unit) {
  CalibrateOptions options;
  options.attitudes.kind = AttitudeKind::kGiven;
  options.attitudes.unknown_fixture_rotation = true;
  options.gauge = Gauge::kFixture;
  options.robust.enabled = false;
  options.cross_validation_folds = 0;
  options.reference.gravity_mps2 = {unit.gravity_mps2, 0.0};
  options.reference.field_ut = {unit.field_ut, 0.0};
  for (const Triad triad : {kAccel, kMag}) {
    options.triads[triad].enabled = unit.models[triad].has_value();
    options.triads[triad].excess = ExcessNoise::kNone;
  }
  return options;
}

Eigen::Quaterniond StatedFixture(const Calibration& calibration) {
  const Eigen::Vector4d& q = *calibration.reference.fixture_from_world;
  return {q[0], q[1], q[2], q[3]};
}

TEST(FixtureRotation, IsFoundExactlyWithTheSensorsHoweverItStands) {
  const SyntheticUnit unit = Unit();
  Random random(3);
  for (int repeat = 0; repeat < 8; ++repeat) {
    const Eigen::Quaterniond fixture_from_world = random.Rotation();
    const PoseSet poses = InFixture(unit, fixture_from_world, 0.0, {}, &random);
    CalibrateOptions options = OptionsFor(unit);
    for (const Triad triad : {kAccel, kMag}) {
      options.triads[triad].noise_sigma_raw = Eigen::Vector3d::Constant(1e-4);
    }
    const auto summary = Calibrate(poses, options);
    ASSERT_TRUE(summary) << summary.error().message;
    const Calibration& found = summary->calibration;
    ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
    for (const Triad triad : {kAccel, kMag}) {
      EXPECT_LT((found.sensors[triad]->model.sensitivity - unit.models[triad]->sensitivity).norm(),
                1e-8);
      EXPECT_LT((found.sensors[triad]->model.bias - unit.models[triad]->bias).norm(), 1e-7);
    }
    EXPECT_LT(StatedFixture(found).angularDistance(fixture_from_world), 1e-7);
  }
}

// χ² of the sensors' errors with their printed covariance, over runs in which the fixture's own
// errors count: inside its 99.9 % interval.
TEST(FixtureRotation, LeavesTheErrorsThatAreStated) {
  const SyntheticUnit unit = Unit();
  SyntheticNoise noise;
  noise.rest_sigma[kAccel] = 0.003;
  noise.rest_sigma[kMag] = 0.05;
  double chi2 = 0.0, dof = 0.0;
  for (std::uint64_t run = 0; run < 40; ++run) {
    Random random(200 + run);
    const PoseSet poses = InFixture(unit, random.Rotation(), 1e-3, noise, &random);
    const auto summary = Calibrate(poses, OptionsFor(unit));
    ASSERT_TRUE(summary) << summary.error().message;
    const Calibration& found = summary->calibration;
    ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
    // The sensors' entries stand first: bias, then the rows of the sensitivity.
    Eigen::VectorXd error(24);
    for (const Triad triad : {kAccel, kMag}) {
      const TriadModel<double>& model = found.sensors[triad]->model;
      const TriadModel<double>& truth = *unit.models[triad];
      const Eigen::Matrix3d matrix = (model.sensitivity - truth.sensitivity).transpose();
      error.segment<12>(triad == kAccel ? 0 : 12) << model.bias - truth.bias, matrix.reshaped();
    }
    ASSERT_EQ(found.covariance.parameters[12], "magnetometer.bias.x");
    const Eigen::MatrixXd covariance = found.covariance.matrix.topLeftCorner(24, 24);
    chi2 += error.dot(PivotedCholesky(covariance).SolveVector(error));
    dof += 24.0;
  }
  RecordProperty("nees_per_dof", std::to_string(chi2 / dof));
  EXPECT_GT(ChiSquareCdf(chi2, dof), 0.0005) << chi2 / dof;
  EXPECT_LT(ChiSquareCdf(chi2, dof), 0.9995) << chi2 / dof;
}

// With one triad alone, only the fixture's frame can be found.
TEST(FixtureRotation, IsRefusedWithoutTheAccelerometer) {
  CalibrateOptions options = OptionsFor(Unit());
  options.triads[kAccel].enabled = false;
  const Status status = options.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("accelerometer"));
}

TEST(GivenAttitudes, StartAMagnetometerAloneHoweverItIsMounted) {
  SyntheticUnit unit = Unit();
  unit.models[kAccel].reset();
  Random random(4);
  const PoseSet poses = InFixture(unit, Eigen::Quaterniond::Identity(), 0.0, {}, &random);
  CalibrateOptions options = OptionsFor(unit);
  options.attitudes.unknown_fixture_rotation = false;
  options.triads[kMag].noise_sigma_raw = Eigen::Vector3d::Constant(1e-4);
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  EXPECT_LT((summary->calibration.sensors[kMag]->model.sensitivity - unit.models[kMag]->sensitivity)
                .norm(),
            1e-8);
  EXPECT_NEAR(*summary->calibration.reference.dip_rad, unit.dip_rad, 1e-9);
}

}  // namespace fixture_test
}  // namespace truetriad
