// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace station_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

// A golden unit and its reference. The accelerometer alone: its own frame is the body's.
class CheckStation : public ::testing::Test {
 protected:
  void SetUp() override {
    const Finished run = RunTruetriad({"calibrate", Log("golden", {}), "-o", folder_.Path("ref")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  std::string Log(const std::string& name, LogOptions options) {
    options.magnetometer = false;
    return folder_.Write(name + ".csv", LogText(options));
  }
  Finished Check(const std::string& log, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {
        "check-station", "--golden=" + folder_.Path("ref/calibration.yaml"), log};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunTruetriad(arguments);
  }

  const TemporaryFolder folder_;
};

TEST_F(CheckStation, AgreesOnAnotherDay) {
  const Finished run = Check(Log("today", {.seed = 7}));
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("STATION AGREES"));
  EXPECT_THAT(run.out, HasSubstr("p = "));
}

TEST_F(CheckStation, NamesWhatDiffersMost) {
  LogOptions today{.seed = 7};
  today.accelerometer.sensitivity(2, 1) += 0.02;
  const Finished run = Check(Log("today", today));
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(run.out, HasSubstr("STATION DOES NOT AGREE"));
  EXPECT_THAT(run.out, HasSubstr("(accelerometer.sensitivity.zy)"));
}

TEST_F(CheckStation, AllowsForWhatTheUnitDoesByItself) {
  LogOptions today{.seed = 7};
  today.accelerometer.bias += Eigen::Vector3d(0.02, -0.02, 0.01);
  const std::string log = Log("today", today);
  EXPECT_EQ(Check(log).exit_code, 4);
  const Finished allowed = Check(log, {"--repeatability=accelerometer.bias=0.015"});
  EXPECT_EQ(allowed.exit_code, 0) << allowed.out << allowed.err;
  const Finished wrong = Check(log, {"--repeatability=accelerometer=0.015"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("expected SENSOR.bias"));
}

// Of one recording the first check counts, whatever is granted to it later.
TEST_F(CheckStation, DoesNotAgreeByASecondLookAtARecording) {
  LogOptions today{.seed = 7};
  today.accelerometer.bias += Eigen::Vector3d(0.02, -0.02, 0.01);
  const std::string log = Log("today", today), store = "--store=" + folder_.Path("fleet.db");
  EXPECT_EQ(Check(log, {store, "--tag=station=S3"}).exit_code, 4);
  const Finished again =
      Check(log, {store, "--tag=station=S3", "--repeatability=accelerometer.bias=0.015"});
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.out, HasSubstr("STATION DOES NOT AGREE"));
}

// Whichever recording is looked at last.
TEST_F(CheckStation, AgreesAsTheLastRecordingOfItsGoldenUnit) {
  LogOptions bent{.seed = 7};
  bent.accelerometer.bias += Eigen::Vector3d(0.02, -0.02, 0.01);
  const auto now = std::filesystem::file_time_type::clock::now();
  const auto check = [&](const std::string& name, LogOptions options, int hours_ago) {
    const std::string log = Log(name, std::move(options));
    std::filesystem::last_write_time(log, now - std::chrono::hours(hours_ago));
    return Check(log, {"--store=" + folder_.Path("fleet.db"), "--tag=station=S3"});
  };
  EXPECT_EQ(check("bent", bent, 3).exit_code, 4);
  const Finished earlier = check("earlier", {.seed = 8}, 4);
  EXPECT_EQ(earlier.exit_code, 4);
  EXPECT_THAT(earlier.out, HasSubstr("DOES NOT COUNT: a later recording of the golden unit"));
  EXPECT_EQ(check("later", {.seed = 9}, 2).exit_code, 0);
  const Finished again = check("bent", bent, 3);
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.out,
              AllOf(HasSubstr("DOES NOT COUNT: a later recording of the golden unit"),
                    HasSubstr(", and agreed"),
                    HasSubstr("STATION DOES NOT AGREE")));
  EXPECT_THAT(again.err, HasSubstr("copying may have changed it"));
}

// Gravity is known to 0.2 % by default, but it is the same on both days.
TEST_F(CheckStation, SeesAllGainsChangeTogether) {
  LogOptions today{.seed = 7};
  today.accelerometer.sensitivity *= 1.0015;
  const Finished run = Check(Log("today", today));
  EXPECT_EQ(run.exit_code, 4) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("STATION DOES NOT AGREE"));
}

TEST_F(CheckStation, IsNotJudgedByTheReadingsOfTheReference) {
  for (const std::string change : {"cat", "head -n -1", "gzip -c"}) {
    const std::string log = folder_.Path(change == "gzip -c" ? "again.csv.gz" : "again.csv");
    ASSERT_EQ(RunShell(change + " '" + folder_.Path("golden.csv") + "' > '" + log + "'").exit_code,
              0);
    const Finished run = Check(log);
    EXPECT_EQ(run.exit_code, 4) << change;
    EXPECT_THAT(run.out, HasSubstr("NO TEST: these are the readings")) << change;
  }
}

TEST_F(CheckStation, IsNotJudgedByARecordingThatIsRefused) {
  const Finished run = Check(Log("flat", {.rests = 16, .in_one_plane = true}));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("cannot be judged"));
}

TEST_F(CheckStation, AsksByWhichExperimentWhereTheReferenceDoesNotSay) {
  const Finished run = RunTruetriad({"check-station",
                                     "--golden=" TRUETRIAD_SOURCE_DIR "/datasets/demo/truth.yaml",
                                     TRUETRIAD_SOURCE_DIR "/datasets/demo/recording.csv"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("--config"));
}

}  // namespace station_test
}  // namespace truetriad
