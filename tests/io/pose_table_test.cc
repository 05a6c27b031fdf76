// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "math/random.h"
#include "support/finding_matchers.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace pose_table_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PoseTables : public ::testing::Test {
 protected:
  Result<PoseTable> Read(const std::string& text) {
    return ReadPoseTable(folder_.Write("poses.csv", text));
  }
  std::string ErrorOf(const std::string& text) {
    const Result<PoseTable> table = Read(text);
    return table ? "" : table.error().message;
  }
  bool IsTable(const std::string& text) { return *IsPoseTable(folder_.Write("poses.csv", text)); }

  const std::string accel_ = "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]";
  TemporaryFolder folder_;
};

TEST_F(PoseTables, AreToldFromLogs) {
  EXPECT_TRUE(IsTable(accel_ + "\n1,2,3\n"));
  EXPECT_TRUE(IsTable("time[s]," + accel_ + ",accel_sigma[m/s^2]\n0,1,2,3,4\n"));
  EXPECT_TRUE(IsTable(accel_ + ",qw,qx,qy,qz\n1,2,3,1,0,0,0\n"));
  EXPECT_FALSE(IsTable("time[s]," + accel_ + "\n0,1,2,3\n"));
  EXPECT_FALSE(IsTable("pose," + accel_ + "\n0,1,2,3\n"));
  EXPECT_FALSE(*IsPoseTable("recording.yaml"));
  EXPECT_FALSE(IsPoseTable(folder_.Path("none.csv")));
}

TEST_F(PoseTables, HoldOnePoseARow) {
  const Result<PoseTable> table =
      Read(accel_ +
           ",accel_sigma[mg],mag_x[uT],mag_y[uT],mag_z[uT],mag_sigma_x[nT],mag_sigma_y[nT],"
           "mag_sigma_z[nT],temperature[degC],id,face\n"
           "0,0,9.8,2,20,1,-43,100,200,300,21,first,+z\n"
           "9.8,0,0,,nan,1,-43,,,,25,,\n");
  ASSERT_TRUE(table) << table.error().message;
  const PoseSet& poses = table->poses;
  ASSERT_EQ(poses.poses.size(), 2U);
  EXPECT_FALSE(poses.has_time);
  EXPECT_EQ(poses.how, "every row");
  const StaticPose& first = poses.poses[0];
  EXPECT_EQ(first.number, 1);
  EXPECT_EQ(first.id, "first");
  EXPECT_EQ(first.face_up, "+z");
  EXPECT_EQ(first.temperature_degc, 21.0);
  const TriadPose& accelerometer = *first.triads[Triad::kAccelerometer];
  EXPECT_EQ(accelerometer.mean_raw, Eigen::Vector3d(0.0, 0.0, 9.8));
  EXPECT_TRUE(accelerometer.has_covariance);
  EXPECT_NEAR(accelerometer.mean_covariance_raw(1, 1), 0.0196133 * 0.0196133, 1e-15);
  const TriadPose& magnetometer = *first.triads[Triad::kMagnetometer];
  EXPECT_NEAR(magnetometer.mean_covariance_raw(2, 2), 0.09, 1e-15);  // 300 nT = 0.3 uT.

  const StaticPose& second = poses.poses[1];
  EXPECT_FALSE(second.triads[Triad::kAccelerometer]->has_covariance);
  EXPECT_FALSE(second.triads[Triad::kMagnetometer]);
  const StreamSummary& stream = *poses.Find(Triad::kMagnetometer);
  EXPECT_EQ(stream.samples, 1);
  EXPECT_EQ(stream.dropped_empty, 1);
  EXPECT_EQ(poses.Find(Triad::kAccelerometer)->maximum_raw, Eigen::Vector3d(9.8, 0.0, 9.8));
  EXPECT_EQ(*poses.temperature_range_degc, Eigen::Vector2d(21.0, 25.0));
  EXPECT_THAT(poses.findings, IsEmpty());
  EXPECT_EQ(table->inputs[0].samples, 2);
}

TEST_F(PoseTables, MayStateAttitudes) {
  const Result<PoseTable> table =
      Read(accel_ + ",qw,qx,qy,qz\n1,2,3,0.7071,0,0.7071,0\n3,2,1,,,,\n");
  ASSERT_TRUE(table) << table.error().message;
  const Eigen::Quaterniond attitude = table->poses.poses[0].attitude->world_from_body;
  EXPECT_NEAR(attitude.norm(), 1.0, 1e-15);
  EXPECT_NEAR((attitude * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-15);
  EXPECT_FALSE(table->poses.poses[1].attitude);
  EXPECT_THAT(ErrorOf(accel_ + ",qw,qx,qy,qz\n1,2,3,1,1,0,0\n"),
              HasSubstr("not a unit quaternion"));
  EXPECT_THAT(ErrorOf(accel_ + ",qw,qx,qy,qz\n1,2,3,1,,0,0\n"),
              HasSubstr("poses.csv:2: column `qw`"));
  EXPECT_THAT(ErrorOf(accel_ + ",qw\n1,2,3,1\n"), HasSubstr("needs all of qw, qx, qy, qz"));
}

TEST_F(PoseTables, WarnOfRepeatedRowsAndRefuseMany) {
  const std::string distinct = "1,2,3\n4,5,6\n7,8,9\n2,2,2\n";
  const Result<PoseTable> table = Read(accel_ + "\n" + distinct + "1,2,3\n");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->poses.findings.size(), 1U);
  EXPECT_THAT(table->poses.findings[0], HasCode(FindingCode::kRepeatedRows));
  EXPECT_THAT(table->poses.findings[0], Says(HasSubstr("(lines 2 and 6)")));
  EXPECT_THAT(ErrorOf(accel_ + "\n" + distinct + "1,2,3\n4,5,6\n7,8,9\n"),
              HasSubstr("3 rows repeat another row's readings"));
  // A slow sensor in a fast log.
  const Result<PoseTable> held = Read(accel_ + "\n1,2,3\n1,2,3\n1,2,3\n4,5,6\n4,5,6\n");
  ASSERT_TRUE(held) << held.error().message;
  EXPECT_EQ(held->poses.poses.size(), 2U);
}

TEST_F(PoseTables, CountRepeatedRowsOnceUnlessTheyStandOtherwise) {
  const Result<PoseTable> once = Read(accel_ + "\n1,2,3\n4,5,6\n7,8,9\n2,2,2\n1,2,3\n");
  ASSERT_TRUE(once) << once.error().message;
  EXPECT_EQ(once->poses.poses.size(), 4U);
  EXPECT_EQ(once->poses.streams[0].samples, 4);
  EXPECT_THAT(once->poses.findings[0], Says(HasSubstr("1 row repeats")));
  EXPECT_THAT(once->poses.findings[0], Says(HasSubstr("count once")));
  // A sensor that stuck while the fixture turned contradicts its attitudes, and may.
  const Result<PoseTable> stuck = Read(accel_ +
                                       ",qw,qx,qy,qz\n1,2,3,1,0,0,0\n4,5,6,0,1,0,0\n"
                                       "7,8,9,0,0,1,0\n1,2,3,0,0,0,1\n");
  ASSERT_TRUE(stuck) << stuck.error().message;
  EXPECT_EQ(stuck->poses.poses.size(), 4U);
  EXPECT_THAT(stuck->poses.findings[0], HasCode(FindingCode::kRepeatedRows));
}

TEST_F(PoseTables, KnowTheStepThatTheyWereRoundedTo) {
  Random random(5);
  const auto table_of = [&](double step) {
    std::string text = accel_ + "\n";
    for (int row = 0; row < 12; ++row) {
      for (int axis = 0; axis < 3; ++axis) {
        double value = 20.0 * random.Uniform() - 10.0;
        if (step > 0.0) value = step * std::round(value / step);
        text += (axis > 0 ? "," : "") + std::to_string(value);
      }
      text += "\n";
    }
    return text;
  };
  const Result<PoseTable> rounded = Read(table_of(0.04)), fine = Read(table_of(0.0));
  ASSERT_TRUE(rounded && fine);
  EXPECT_NEAR(rounded->poses.streams[0].resolution_raw.maxCoeff(), 0.04, 1e-8);
  EXPECT_LT(fine->poses.streams[0].resolution_raw.maxCoeff(), 1e-4);
}

// Neither stuck nor clipped: no readings.
TEST_F(PoseTables, LeaveOutZeros) {
  std::string text = accel_ + ",mag_x[uT],mag_y[uT],mag_z[uT]\n";
  for (int i = 0; i < 12; ++i) {
    const std::string reading = std::to_string(i) + ",2,9";
    text += (i < 4 ? "0,0,0" : reading) + "," + (i == 1 || i == 7 ? "0,0,0" : reading) + "\n";
  }
  const Result<PoseTable> table = Read(text);
  ASSERT_TRUE(table) << table.error().message;
  const PoseSet& poses = table->poses;
  EXPECT_EQ(poses.poses.size(), 11U);  // one row had none at all
  EXPECT_FALSE(poses.poses[0].triads[Triad::kAccelerometer]);
  EXPECT_TRUE(poses.poses[0].triads[Triad::kMagnetometer]);
  ASSERT_EQ(poses.findings.size(), 2U);
  EXPECT_EQ(poses.findings[0].code, FindingCode::kImpossibleRows);
  EXPECT_EQ(poses.findings[0].Value("rows"), 4.0);
  EXPECT_THAT(poses.findings[1].text, HasSubstr("the first is line 3"));
}

// An error word or a slipped decimal point, not what an offset, readings near zero or many rows at
// one attitude make of good ones.
TEST_F(PoseTables, LeaveOutWhatIsTenTimesAsLongAsTheOthers) {
  Random random(3);
  struct Case {
    Eigen::Vector3d bias;
    double strength;
    int alike;  // rows at one attitude
    Eigen::Vector3d bad;
  };
  const Eigen::Vector3d none = Eigen::Vector3d::Zero(), word(9999.0, 9999.0, 9999.0);
  for (const Case& c : {Case{{0.1, -0.2, 0.1}, 9.8, 0, word},
                        Case{{0.1, -0.2, 0.1}, 9.8, 0, {0.0, 0.0, -490.0}},
                        Case{{0.1, -0.2, 0.1}, 9.8, 16, none},
                        Case{{9.8, 0.0, 0.0}, 9.8, 0, none},
                        Case{{2048.0, 2050.0, 2040.0}, 256.0, 0, none}}) {
    std::string text = accel_ + "\n";
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d direction =
          i < c.alike ? Eigen::Vector3d(0.0, 0.0, 1.0) : random.Normal3().normalized();
      const Eigen::Vector3d reading =
          i == 17 && !c.bad.isZero() ? c.bad
                                     : c.bias + c.strength * direction + 0.01 * random.Normal3();
      text += std::to_string(reading.x()) + "," + std::to_string(reading.y()) + "," +
              std::to_string(reading.z()) + "\n";
    }
    const Result<PoseTable> table = Read(text);
    ASSERT_TRUE(table) << table.error().message;
    const PoseSet& poses = table->poses;
    if (c.bad.isZero()) {
      EXPECT_EQ(poses.poses.size(), 20U);
      EXPECT_THAT(poses.findings, IsEmpty());
      continue;
    }
    EXPECT_EQ(poses.poses.size(), 19U);
    EXPECT_EQ(poses.poses.back().number, 19);
    EXPECT_LT(poses.Find(Triad::kAccelerometer)->maximum_raw.norm(), 20.0);
    ASSERT_EQ(poses.findings.size(), 1U);
    EXPECT_EQ(poses.findings[0].code, FindingCode::kImpossibleRows);
    EXPECT_THAT(poses.findings[0].text, HasSubstr("is left out: line 19"));
  }
}

TEST_F(PoseTables, AreRefusedWhenReadingsPileUpAtAnExtreme) {
  std::string text = accel_ + "\n";
  for (int k = 0; k < 12; ++k) {
    text += std::to_string(0.1 * k) + "," + std::to_string(1.0 - 0.2 * k) + "," +
            (k % 3 == 0 ? "7.5" : std::to_string(0.3 * k)) + "\n";
  }
  EXPECT_THAT(ErrorOf(text),
              AllOf(HasSubstr("accelerometer axis z is clipped"), HasSubstr("in 4 of 12 rows")));
}

TEST_F(PoseTables, RefuseWhatTheyWouldHaveToGuess) {
  EXPECT_THAT(ErrorOf("accel_x,accel_y,accel_z\n1,2,3\n"), HasSubstr("has no unit"));
  EXPECT_THAT(ErrorOf(accel_ + ",accel_sigma\n1,2,3,4\n"),
              HasSubstr("column `accel_sigma`: has no unit"));
  EXPECT_THAT(ErrorOf(accel_ + ",accel_sigma[counts]\n1,2,3,4\n"), HasSubstr("is in counts"));
  EXPECT_THAT(ErrorOf(accel_ + ",accel_sigma[g]\n1,2,3,0\n"), HasSubstr("must be above zero"));
  EXPECT_THAT(ErrorOf(accel_ + ",face\n1,2,3,top\n"), HasSubstr("`top` is not among +x"));
  EXPECT_THAT(ErrorOf(accel_ + ",gyr_x\n1,2,3,4\n"), HasSubstr("column `gyr_x` is unknown"));
  EXPECT_THAT(ErrorOf("temperature[degC]\n20\n"), HasSubstr("no sensor columns"));
}

TEST_F(PoseTables, RefuseALogThatLacksItsTime) {
  std::string text = accel_ + "\n";
  for (int i = 0; i <= 100'001; ++i) text += std::to_string(i) + ",2,3\n";
  EXPECT_THAT(ErrorOf(text), HasSubstr("add `time[s]`"));
}

}  // namespace pose_table_test
}  // namespace truetriad
