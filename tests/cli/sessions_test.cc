// SPDX-License-Identifier: Apache-2.0
//
// Several recordings of one unit, from scenario to calibration.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace sessions_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::StartsWith;

class SeveralSessions : public ::testing::Test {
 protected:
  void SetUp() override {
    const Finished run = RunTruetriad({"simulate",
                                       "--config=configs/scenarios/sessions.yaml",
                                       "--output=" + folder_.Path("unit")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("3 sessions"));
  }
  std::string Session(int number) const {
    return folder_.Path("unit/session-" + std::to_string(number) + "/recording.yaml");
  }
  Finished Calibrate(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"calibrate",
                                          "--config=configs/experiments/sessions.yaml",
                                          "--output=" + folder_.Path("result")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunTruetriad(arguments);
  }
  std::string AllInputs() const { return Session(1) + "," + Session(2) + "," + Session(3); }

  TemporaryFolder folder_;
};

// `compare` prints AGREE when χ² of the differences has p >= 0.01; the seed is fixed.
TEST_F(SeveralSessions, CalibrateToTheUnitOnTheMeanOfThem) {
  const Finished run = Calibrate({"--input=" + AllInputs()});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("bias by session"), HasSubstr("repeatability, 1 σ")));
  const std::string file = folder_.Path("result/calibration.yaml");
  const Finished compared =
      RunTruetriad({"compare", "--a=" + folder_.Path("unit/truth.yaml"), "--b=" + file});
  EXPECT_THAT(compared.out, StartsWith("AGREE"));
  const Result<Calibration> calibration = ReadCalibration(file);
  ASSERT_TRUE(calibration) << calibration.error().message;
  // Accelerometer and gyroscope, three each.
  EXPECT_THAT(calibration->quality.rests.sessions, SizeIs(6));
  ASSERT_THAT(calibration->quality.rests.repeatability, SizeIs(2));
  EXPECT_EQ(calibration->quality.rests.repeatability.back().sessions, 3);
  EXPECT_EQ(calibration->quality.rests.sessions.front().file, Session(1));
}

// What the result says of the experiment is one that gives the same result.
TEST_F(SeveralSessions, CanBeCalibratedAgainFromTheirResult) {
  ASSERT_EQ(Calibrate({"--set=input=[" + AllInputs() + "]"}).exit_code, 0);
  const Finished again = RunTruetriad({"calibrate",
                                       "--config=" + folder_.Path("result/calibration.yaml"),
                                       "--output=" + folder_.Path("again")});
  ASSERT_EQ(again.exit_code, 0) << again.out << again.err;
  const Finished compared = RunTruetriad({"compare",
                                          "--a=" + folder_.Path("result/calibration.yaml"),
                                          "--b=" + folder_.Path("again/calibration.yaml")});
  EXPECT_THAT(compared.out, StartsWith("AGREE"));
}

TEST_F(SeveralSessions, OfAnotherUnitAreBadInput) {
  const std::string other = folder_.Path("other");
  ASSERT_EQ(RunTruetriad({"simulate",
                          "--config=configs/scenarios/consumer-9dof.yaml",
                          "--set=device.serial=B0002",
                          "--output=" + other})
                .exit_code,
            0);
  const Finished run = Calibrate({"--input=" + Session(1) + "," + other + "/recording.yaml"});
  EXPECT_EQ(run.exit_code, 2) << run.out;
  EXPECT_THAT(run.err, AllOf(HasSubstr("of unit `B0002`"), HasSubstr("of unit `A0001`")));
}

TEST_F(SeveralSessions, TakeNothingThatHasAPlaceInOneRecording) {
  const Finished run =
      Calibrate({"--input=" + AllInputs(), "--set=exclude=[{ from_s: 0, to_s: 1 }]"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, AllOf(HasSubstr("--set=exclude"), HasSubstr("use `exclude_poses:`")));
}

// The σ of a mean of two would be too small by a factor of √2.
TEST_F(SeveralSessions, AreNotTheSameReadingsTwice) {
  const std::string copy = folder_.Path("copy.csv");
  ASSERT_EQ(RunShell("head -n -5 datasets/demo/recording.csv > '" + copy + "'").exit_code, 0);
  const Finished run =
      RunTruetriad({"calibrate", "datasets/demo/recording.csv", copy, "-o", folder_.Path("twice")});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("has readings of datasets/demo/recording.csv"));
}

}  // namespace sessions_test
}  // namespace truetriad
