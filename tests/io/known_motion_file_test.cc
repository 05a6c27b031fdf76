// SPDX-License-Identifier: Apache-2.0
#include "io/known_motion_file.h"

#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace known_motion_file_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

class KnownMotionFile : public ::testing::Test {
 protected:
  std::string File(const std::string& text) {
    std::ofstream(folder_.Path("motions.yaml")) << text;
    return folder_.Path("motions.yaml");
  }
  TemporaryFolder folder_;
};

TEST_F(KnownMotionFile, ReadsTurnsAboutAnAxisOrAVector) {
  const auto turns =
      ReadStatedTurns(File("turns:\n"
                           "  - { first: 10, last: 20, axis: -y, turns: 2, id: back }\n"
                           "  - { after_pose: 3, axis: [0, 3, 4], degrees: -90, sigma_deg: 2 }\n"),
                      {0.1, 0.2});
  ASSERT_TRUE(turns) << turns.error().message;
  ASSERT_EQ(turns->size(), 2U);
  const StatedTurn& first = turns->front();
  EXPECT_EQ(first.at.rows.first, 10);
  EXPECT_EQ(first.at.rows.last, 20);
  EXPECT_EQ(first.axis, -Eigen::Vector3d::UnitY());
  EXPECT_DOUBLE_EQ(first.angle_rad, 4.0 * std::numbers::pi);
  EXPECT_EQ(first.sigma_rad, 0.1);
  EXPECT_EQ(first.axis_sigma_rad, 0.2);
  EXPECT_EQ(first.id, "back");
  const StatedTurn& second = turns->back();
  EXPECT_TRUE(second.at.rows.empty());
  EXPECT_EQ(second.at.pose, 3);
  EXPECT_LT((second.axis - Eigen::Vector3d(0.0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(second.angle_rad, -0.5 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(second.sigma_rad, 2.0 * kRadPerDeg);
}

TEST_F(KnownMotionFile, GivesARateTheUncertaintyOfItsDirectionAcrossItself) {
  const auto rates = ReadStatedRates(File("rates:\n"
                                          "  - { first: 0, last: 9, axis: z, degps: -50 }\n"
                                          "  - { pose: 2, rate_degps: [0, 0, 0] }\n"),
                                     {0.01, 0.1});
  ASSERT_TRUE(rates) << rates.error().message;
  EXPECT_DOUBLE_EQ(rates->front().rate_radps.z(), -50.0 * kRadPerDeg);
  const double across = 0.1 * 50.0 * kRadPerDeg;
  EXPECT_NEAR(rates->front().covariance_radps2(0, 0), 1e-4 + across * across, 1e-15);
  EXPECT_NEAR(rates->front().covariance_radps2(2, 2), 1e-4, 1e-15);
  EXPECT_EQ(rates->back().at.pose, 2);
  EXPECT_NEAR(rates->back().covariance_radps2(0, 0), 1e-4, 1e-15);
}

TEST_F(KnownMotionFile, ReadsPlacesByTime) {
  const auto turns = ReadStatedTurns(
      File("turns:\n  - { start_s: 12.25, end_s: 20, axis: z, turns: 1 }\n"), {0.1, 0.2});
  ASSERT_TRUE(turns) << turns.error().message;
  const MotionPlace& at = turns->front().at;
  EXPECT_EQ(at.times.start_ns, 12'250'000'000);
  EXPECT_EQ(at.times.end_ns, 20'000'000'000);
  EXPECT_TRUE(at.rows.empty());
  EXPECT_FALSE(at.is_pose());
  EXPECT_EQ(at.stated_in, folder_.Path("motions.yaml") + ":2");
  const auto wrong =
      ReadStatedRates(File("rates:\n"
                           "  - { start_s: 2, end_s: 1, axis: z, degps: 5 }\n"
                           "  - { start_s: 2, axis: z, degps: 5 }\n"
                           "  - { start_s: 2, end_s: 3, first: 4, axis: z, degps: 5 }\n"),
                      {});
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message,
              AllOf(HasSubstr("motions.yaml:2"),
                    HasSubstr("expected start_s < end_s"),
                    HasSubstr("motions.yaml:3"),
                    HasSubstr("end_s"),
                    HasSubstr("motions.yaml:4"),
                    HasSubstr("states in several ways where in the recording it happens")));
}

TEST_F(KnownMotionFile, SaysWhatIsWrongWithItsLine) {
  const auto turns = ReadStatedTurns(File("turns:\n"
                                          "  - { first: 10, last: 5, axis: x, turns: 1 }\n"
                                          "  - { axis: w, turns: 1, degrees: 360 }\n"
                                          "  - { after_pose: 1, first: 0, axis: x, turns: 0 }\n"),
                                     {0.1, 0.2});
  ASSERT_FALSE(turns);
  EXPECT_THAT(turns.error().message,
              AllOf(HasSubstr("motions.yaml:2"),
                    HasSubstr("10 to 5"),
                    HasSubstr("does not state where in the recording it happens"),
                    HasSubstr("`w` is not among"),
                    HasSubstr("either `turns` or `degrees`"),
                    HasSubstr("states in several ways where in the recording it happens"),
                    HasSubstr("angle is zero")));
  EXPECT_FALSE(ReadStatedRates(File("rates: []\n"), {}));
  const auto rates = ReadStatedRates(File("rates: [ { pose: 0, axis: x, degps: 1 } ]\n"), {});
  ASSERT_FALSE(rates);
  EXPECT_THAT(rates.error().message, HasSubstr("number of a pose"));
}

TEST_F(KnownMotionFile, WritesWhatItReads) {
  StatedTurn turn;
  turn.at.rows = {5, 99};
  turn.axis = Eigen::Vector3d(1.0, -2.0, 2.0) / 3.0;
  turn.angle_rad = -6.0 * std::numbers::pi;
  turn.id = "three \"times\"";
  const auto turns = ReadStatedTurns(File(StatedTurnsToYaml({turn})), {0.1, 0.1});
  ASSERT_TRUE(turns) << turns.error().message;
  EXPECT_LT((turns->front().axis - turn.axis).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(turns->front().angle_rad, turn.angle_rad);
  EXPECT_EQ(turns->front().id, turn.id);
  StatedRate rate;
  rate.at.pose = 4;
  rate.rate_radps << 0.25, 0.0, -3.0;
  const auto rates = ReadStatedRates(File(StatedRatesToYaml({rate})), {});
  ASSERT_TRUE(rates) << rates.error().message;
  EXPECT_LT((rates->front().rate_radps - rate.rate_radps).norm(), 1e-15);
  EXPECT_EQ(rates->front().at.pose, 4);
}

// Making a unit vector of one again may change its last bits.
TEST_F(KnownMotionFile, KeepsTheBitsOfAnAxisThatItWrote) {
  const auto turns = ReadStatedTurns(
      File("turns: [ { after_pose: 3, axis: [5, 0.6, 0.9], turns: -2 } ]\n"), {0.1, 0.1});
  ASSERT_TRUE(turns) << turns.error().message;
  const auto again = ReadStatedTurns(File(StatedTurnsToYaml(*turns)), {0.1, 0.1});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->front().axis, turns->front().axis);
}

TEST_F(KnownMotionFile, RefusesAnAxisWhoseLengthIsNoNumber) {
  for (const char* const axis : {"[0, 0, 0]", "[1e200, 0, 0]"}) {
    const auto turns = ReadStatedTurns(
        File("turns: [ { after_pose: 3, axis: " + std::string(axis) + ", turns: 1 } ]\n"), {});
    ASSERT_FALSE(turns) << axis;
    EXPECT_THAT(turns.error().message, HasSubstr("motions.yaml:1: turns[0].axis: "));
  }
}

}  // namespace known_motion_file_test
}  // namespace truetriad
