// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/charts.h"
#include "report/sample_calibration.h"

namespace truetriad {
namespace sphere_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(SpherePoints, AreTheReadingsInSharesOfWhatThereIsToRead) {
  const Calibration calibration = SampleCalibration();
  const auto& sensor = *calibration.sensors[Triad::kAccelerometer];
  const double gravity = calibration.reference.gravity_mps2;
  const std::vector<SpherePoint> points = SpherePoints(calibration, Triad::kAccelerometer);
  ASSERT_EQ(points.size(), 24U);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PoseResidual& pose = calibration.quality.rests.pose_residuals[i];
    EXPECT_EQ(points[i].pose, pose.pose);
    EXPECT_NEAR(gravity * points[i].corrected.norm() - gravity, pose.norm_error, 1e-12);
    // The log is in m/s^2: the raw point corrected is the corrected one.
    EXPECT_LT(
        (sensor.model.TruthFromRaw(gravity * points[i].raw) / gravity - points[i].corrected).norm(),
        1e-12);
  }
}

TEST(SpherePoints, OfCountsAreTakenByTheirMeanGain) {
  const Calibration calibration = SampleCalibration();
  double mean = 0.0;
  const std::vector<SpherePoint> points = SpherePoints(calibration, Triad::kMagnetometer);
  ASSERT_EQ(points.size(), 24U);
  EXPECT_TRUE(points[6].is_rejected);
  const auto& sensor = *calibration.sensors[Triad::kMagnetometer];
  const Eigen::Vector3d centre =
      sensor.model.bias / std::cbrt(sensor.model.sensitivity.determinant()) / 48.0;
  for (const SpherePoint& point : points) mean += (point.raw - centre).norm() / 24.0;
  // Gains of 10 ± 3 %, and the rejected one is off by 3 of 48 uT.
  EXPECT_NEAR(mean, 1.0, 0.03);
}

TEST(WeakAxis, IsWhereTheBiasIsKnownWorst) {
  Calibration calibration = SampleCalibration();
  EXPECT_FALSE(WeakAxisOf({}, Triad::kAccelerometer).has_value());
  NamedCovariance& covariance = calibration.covariance;
  const auto set = [&](const std::string& name, double sigma) {
    const auto found = std::find(covariance.parameters.begin(), covariance.parameters.end(), name);
    ASSERT_NE(found, covariance.parameters.end()) << name;
    const Eigen::Index at = found - covariance.parameters.begin();
    covariance.matrix.row(at).setZero();
    covariance.matrix.col(at).setZero();
    covariance.matrix(at, at) = sigma * sigma;
  };
  for (const char* axis : {"x", "y", "z"}) set(std::string("accelerometer.bias.") + axis, 0.01);
  EXPECT_FALSE(WeakAxisOf(calibration, Triad::kAccelerometer).has_value());
  set("accelerometer.bias.y", 0.05);
  const auto weak = WeakAxisOf(calibration, Triad::kAccelerometer);
  ASSERT_TRUE(weak.has_value());
  EXPECT_NEAR(weak->direction.y(), 1.0, 0.05);
  // The log is in m/s^2, with gains near 1.
  EXPECT_NEAR(weak->sigma, 0.05, 0.005);
  EXPECT_NEAR(weak->across, 0.01, 0.001);
  const Drawing drawing = SphereDrawing(calibration, Triad::kAccelerometer, false);
  EXPECT_THAT(drawing.svg, HasSubstr("class=\"weak\""));
  EXPECT_THAT(drawing.caption, HasSubstr("Arrow: along (0.0"));
}

TEST(SpherePoints, AreEnlargedSoThatTheGreatestErrorIsSeen) {
  SpherePoint point;
  point.corrected = point.truth;
  for (const auto& [error, factor] :
       {std::pair(1.0, 1.0), {0.4, 1.0}, {0.19, 2.0}, {0.01, 20.0}, {0.0011, 200.0}}) {
    point.raw = point.truth + Eigen::Vector3d(error, 0.0, 0.0);
    EXPECT_EQ(SphereMagnification({point}), factor) << error;
  }
}

TEST(SpherePoints, KeepWhatIsRejectedAndTheGreatestErrorsHoweverManyThereAre) {
  std::vector<SpherePoint> points(10000);
  for (SpherePoint& point : points) point.corrected = point.raw = point.truth;
  for (const std::size_t i : {17U, 18U, 19U, 7000U}) points[i].is_rejected = true;
  points[4321].corrected.x() = 0.1;
  const std::vector<SpherePoint> kept = GreatestOfRuns(points, 500);
  EXPECT_EQ(kept.size(), 504U);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](const auto& p) { return p.is_rejected; }),
            4);
  EXPECT_EQ(
      std::count_if(kept.begin(), kept.end(), [](const auto& p) { return p.corrected.x() > 0; }),
      1);
}

// Hard iron of eight fields: the sphere is small, and every reading has its place.
TEST(SphereDrawing, HasRoomForReadingsFarBeyondTheSphere) {
  Calibration calibration = SampleCalibration();
  calibration.sensors[Triad::kMagnetometer]->model.bias = {3800.0, 0.0, 0.0};
  const std::vector<SpherePoint> points = SpherePoints(calibration, Triad::kMagnetometer);
  EXPECT_GT(SphereReach(points, 1.0), 7.0);
  // The furthest is 118 units to the right of the first centre at most, and none stands there
  // twice.
  EXPECT_THAT(SphereDrawing(calibration, Triad::kMagnetometer, false).svg,
              Not(HasSubstr("M268.0 268.0")));
}

TEST(CoverageDrawing, ShadesHolesAndTakesTheNextPoseThere) {
  Calibration calibration = SampleCalibration(60);
  EXPECT_THAT(CoverageDrawing(calibration.quality, Triad::kAccelerometer).svg,
              Not(HasSubstr("class=\"hole\"")));
  EXPECT_FALSE(NextPoseFor(calibration));
  std::erase_if(calibration.quality.rests.pose_residuals,
                [](const PoseResidual& pose) { return pose.direction.z() < 0.0; });
  EXPECT_THAT(CoverageDrawing(calibration.quality, Triad::kAccelerometer).svg,
              HasSubstr("class=\"hole\""));
  const std::optional<NextPose> next = NextPoseFor(calibration);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->triad, Triad::kAccelerometer);
  EXPECT_LT(next->direction.z(), -0.9);
  EXPECT_LT((next->world_from_body * next->direction - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

// One bad pose in a hundred thousand stays in the picture.
TEST(ResidualDrawing, KeepsWhatIsFarOffHoweverManyPosesThereAre) {
  Calibration calibration = SampleCalibration();
  auto& poses = calibration.quality.rests.pose_residuals;
  const PoseResidual usual = poses.front();
  poses.assign(100000, usual);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].pose = static_cast<int>(i) + 1;
  poses[77777].residual = {0.0, 1.0, 0.0};
  const std::string chart =
      ResidualDrawing(poses, calibration.sensors[Triad::kAccelerometer], Triad::kAccelerometer).svg;
  EXPECT_LT(chart.size(), 60000U);
  // The frame of y begins at 128 and is 76 high; its range is that of the greatest, 1, and a
  // twenty-fifth more on each side.
  EXPECT_THAT(chart, HasSubstr(" 130.8h0"));
}

}  // namespace sphere_test
}  // namespace truetriad
