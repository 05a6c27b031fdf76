// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/sample_calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace inspection_text_test {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const Result<Calibration> kNone = Error(ErrorCode::kNotEnoughData, "none was tried");

StaticPose PoseAt(int number, const Eigen::Vector3d& direction) {
  StaticPose pose;
  pose.number = number;
  pose.start_ns = number * 5'000'000'000LL;
  pose.end_ns = pose.start_ns + 4'000'000'000LL;
  pose.temperature_degc = 24.5;
  TriadPose reading;
  reading.samples = 400;
  reading.mean_raw = 9.8 * direction + Eigen::Vector3d(0.1, -0.2, 0.3);
  reading.mean_covariance_raw = 1e-6 * Eigen::Matrix3d::Identity();
  reading.has_covariance = true;
  pose.triads[Triad::kAccelerometer] = reading;
  return pose;
}

PoseSet EmptySet() {
  PoseSet poses;
  poses.source = "recording.csv";
  poses.how = "static detection";
  poses.duration_s = 120.0;
  poses.static_share = 0.8;
  StreamSummary stream;
  stream.unit.name = "m/s^2";
  stream.samples = 12000;
  stream.rate_hz = 100.0;
  stream.stamps = StampKind::kInBursts;
  stream.jitter_s = 0.002;
  stream.gaps = 3;
  stream.longest_gap_s = 0.25;
  stream.noise_sigma_raw.setConstant(0.02);
  poses.streams = {stream};
  return poses;
}

PoseSet EvenPoses(int count) {
  PoseSet poses = EmptySet();
  for (int i = 0; i < count; ++i) poses.poses.push_back(PoseAt(i + 1, SpiralDirection(i, count)));
  return poses;
}

TEST(InspectionText, SaysWhatWasFound) {
  PoseSet poses = EvenPoses(24);
  poses.temperature_range_degc = Eigen::Vector2d(24.0, 31.5);
  poses.findings = {{FindingCode::kClippedPoses, "accelerometer x clips at 16 g in 12 samples"}};
  const std::string text = ReportOf(poses, kNone).text;
  for (const char* part : {"24 poses by static detection in 120.0 s, 80 % of it at rest",
                           "24.0 to 31.5 °C",
                           "WARNING: accelerometer x clips",
                           "accelerometer   m/s²     12000         100             2   in bursts   "
                           "     3          0.25"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, ContainsRegex("accelerometer +24 +24 "));
  EXPECT_THAT(text, Not(HasSubstr("magnetometer")));
}

TEST(InspectionText, BeginsWithWhatACalibrationMakesOfIt) {
  const Result<Calibration> usable = SampleCalibration();
  EXPECT_THAT(ReportOf(EvenPoses(24), usable).text, StartsWith("ENOUGH for a usable calibration"));
  EXPECT_THAT(ReportOf(EvenPoses(24), usable).text,
              ContainsRegex("Is it enough(.|\n)*accelerometer +± .* m/s² +± .* % +± .* mrad"));
  EXPECT_EQ(ReportOf(EvenPoses(24), usable).grade, Grade::kGood);

  Calibration refused;
  refused.outcome = Outcome::kNotConverged;
  refused.findings = {
      Finding(FindingCode::kWrongUnit, "it reads 9.8 g at rest").As(Severity::kRefusal)};
  const std::string text = ReportOf(EvenPoses(24), refused).text;
  EXPECT_THAT(text, StartsWith("NOT USABLE: wrong-unit\nit reads 9.8 g at rest"));
  EXPECT_THAT(text, Not(HasSubstr("Is it enough?")));
  EXPECT_EQ(ReportOf(EvenPoses(24), refused).grade, Grade::kBad);

  refused.outcome = Outcome::kNotEnough;
  refused.findings = {Finding(FindingCode::kTooFewPoses, "4 poses").As(Severity::kRefusal)};
  EXPECT_THAT(ReportOf(EvenPoses(4), refused).text, StartsWith("NOT ENOUGH: too-few-poses"));
}

TEST(InspectionText, CountsARepeatedPoseOnce) {
  PoseSet poses = EmptySet();
  for (int i = 0; i < 24; ++i) poses.poses.push_back(PoseAt(i + 1, SpiralDirection(i % 6, 6)));
  EXPECT_THAT(ReportOf(poses, kNone).text, ContainsRegex("accelerometer +24 +6 "));
}

TEST(InspectionText, ShortensLongTablesInTheMiddle) {
  const std::string text = ReportOf(EvenPoses(100), kNone).text;
  EXPECT_THAT(text, HasSubstr("100, the middle omitted"));
  EXPECT_THAT(text, ContainsRegex("\n +30 +150.0"));
  EXPECT_THAT(text, Not(ContainsRegex("\n +31 +155.0")));
  EXPECT_THAT(text, ContainsRegex("\n +100 +500.0"));
}

TEST(InspectionText, CopesWithNoPosesAndNoTime) {
  PoseSet poses = EmptySet();
  poses.has_time = false;
  EXPECT_THAT(ReportOf(poses, kNone).text, StartsWith("NOT ENOUGH for any calibration"));
  EXPECT_THAT(ReportOf(PoseSet{}, kNone).text, HasSubstr("0 poses"));
}

}  // namespace inspection_text_test
}  // namespace truetriad
