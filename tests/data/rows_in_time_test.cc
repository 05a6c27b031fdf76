// SPDX-License-Identifier: Apache-2.0
#include "data/rows_in_time.h"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/random.h"

namespace truetriad {
namespace rows_in_time_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kRows = 1500;

void AddRow(const Eigen::Vector3d& reading, PoseSet* poses) {
  StaticPose& pose = poses->poses.emplace_back();
  pose.triads[Triad::kAccelerometer].emplace();
  pose.triads[Triad::kAccelerometer]->samples = 1;
  pose.triads[Triad::kAccelerometer]->mean_raw = reading;
}

// Turned by `step_rad` from each row to the next, with noise of 0.3 % of gravity.
PoseSet Rows(double step_rad, int count = kRows) {
  Random random(1);
  PoseSet poses;
  poses.source = "log.csv";
  poses.has_time = false;
  for (int i = 0; i < count; ++i) {
    const double angle = step_rad * i;
    AddRow(9.8 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0) + 0.03 * random.Normal3(),
           &poses);
  }
  return poses;
}

TEST(RowsInTime, RowsLikeTheOneBeforeAreALog) {
  const Status status = RejectRowsOfALog(Rows(0.003));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kMissingTime);
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("log.csv"), HasSubstr("1500 rows"), HasSubstr("rate_hz: 100")));
}

// Headings 5 degrees apart at a dip of 60: gravity stays in the body.
TEST(RowsInTime, ATableOfHeadingsIsOfRests) {
  PoseSet poses = Rows(0.0);
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    const double heading = 0.0873 * static_cast<double>(k);
    auto& reading = poses.poses[k].triads[Triad::kMagnetometer].emplace();
    reading.mean_raw = {24.0 * std::cos(heading), 24.0 * std::sin(heading), 42.0};
  }
  EXPECT_TRUE(RejectRowsOfALog(poses));
  for (StaticPose& pose : poses.poses) {
    pose.triads[Triad::kMagnetometer]->mean_raw = {24.0, 0.0, 42.0};
  }
  EXPECT_FALSE(RejectRowsOfALog(poses));
}

TEST(RowsInTime, AttitudesInAnyOrderAreRests) { EXPECT_TRUE(RejectRowsOfALog(Rows(2.4))); }

TEST(RowsInTime, FewRowsAreRests) { EXPECT_TRUE(RejectRowsOfALog(Rows(0.003, 1000))); }

TEST(RowsInTime, WhatHasASigmaIsARest) {
  PoseSet poses = Rows(0.003);
  for (StaticPose& pose : poses.poses) pose.triads[Triad::kAccelerometer]->has_covariance = true;
  EXPECT_TRUE(RejectRowsOfALog(poses));
}

TEST(RowsInTime, WhatHasANameOrAnAttitudeIsARest) {
  PoseSet poses = Rows(0.003);
  poses.poses[7].id = "p8";
  EXPECT_TRUE(RejectRowsOfALog(poses));
  poses = Rows(0.003);
  poses.poses[7].face_up = "+x";
  EXPECT_TRUE(RejectRowsOfALog(poses));
  poses = Rows(0.003);
  poses.poses[7].attitude.emplace();
  EXPECT_TRUE(RejectRowsOfALog(poses));
}

// A gyroscope says so of any number of rows.
TEST(RowsInTime, RowsInWhichTheGyroscopeTurnsAreALog) {
  const auto rows = [](double degps) {
    PoseSet poses = Rows(2.4, 40);
    StreamSummary& stream = poses.streams.emplace_back();
    stream.triad = Triad::kGyroscope;
    stream.unit.truth_per_raw = 0.0174533;
    for (std::size_t i = 0; i < poses.poses.size(); ++i) {
      poses.poses[i].triads[Triad::kGyroscope].emplace();
      poses.poses[i].triads[Triad::kGyroscope]->mean_raw = {i % 8 == 0 ? degps : 1.0, -2.0, 3.0};
    }
    return poses;
  };
  EXPECT_TRUE(RejectRowsOfALog(rows(5.0)));
  const Status status = RejectRowsOfALog(rows(20.0));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kMissingTime);
  EXPECT_THAT(status.error().message, HasSubstr("the gyroscope shows rotation in 5 of them"));
}

TEST(RowsInTime, WithTimesNothingIsAsked) {
  PoseSet poses = Rows(0.003);
  poses.has_time = true;
  EXPECT_TRUE(RejectRowsOfALog(poses));
}

}  // namespace rows_in_time_test
}  // namespace truetriad
