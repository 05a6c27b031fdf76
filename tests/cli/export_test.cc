// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"

namespace truetriad {
namespace export_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr char kDemo[] = "datasets/demo/truth.yaml";

TEST(ExportVerb, WritesTheFileAndSaysWhatIsLost) {
  const TemporaryFolder folder;
  const std::string file = folder.Path("below/unit.params");
  const Finished run = RunTruetriad(
      {"export", std::string("--calibration=") + kDemo, "--to=px4", "--id=7", "--output=" + file});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr(file + "\n"),
                    HasSubstr("at most"),
                    HasSubstr("gyroscope: dropped: gains and misalignment")));
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(TemporaryFolder::Read(file), HasSubstr("CAL_MAG0_XOFF\t0.124\t9"));
}

TEST(ExportVerb, RefusesMoreLossThanAllowedAndWritesNothing) {
  const TemporaryFolder folder;
  for (const char* spelling : {"--max-loss=1e-3", "--max_loss=1e-3"}) {
    const Finished run = RunTruetriad({"export",
                                       std::string("--calibration=") + kDemo,
                                       "--to=px4",
                                       spelling,
                                       "--output=" + folder.Path("unit.params")});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.out, IsEmpty());
    EXPECT_THAT(run.err, HasSubstr("more than --max-loss=0.001"));
  }
  EXPECT_EQ(folder.FileCount(), 0U);
}

TEST(ExportVerb, WritesNothingBesideAnotherUnitsCalibration) {
  const TemporaryFolder folder;
  std::string text = TemporaryFolder::Read(TRUETRIAD_SOURCE_DIR "/datasets/demo/truth.yaml");
  const std::size_t serial = text.find("A0001");
  ASSERT_NE(serial, std::string::npos);
  text.replace(serial, 5, "B0003");
  folder.Write("calibration.yaml", text);
  folder.Write("calibration.h", "B0003's");
  const Finished run = RunTruetriad({"export",
                                     std::string("--calibration=") + kDemo,
                                     "--to=c-header",
                                     "--output=" + folder.Path("calibration.h")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("calibration.yaml: is the calibration of unit `B0003`"));
  EXPECT_EQ(TemporaryFolder::Read(folder.Path("calibration.h")), "B0003's");
}

TEST(ExportVerb, ReplacesNothingButExports) {
  const TemporaryFolder folder;
  const std::string file = folder.Path("px4.params");
  const auto run = [&](const std::string& further) {
    return RunTruetriad(
        {"export", std::string("--calibration=") + kDemo, "--to=px4", "--output=" + file, further});
  };
  folder.Write("px4.params", "1\t1\tCAL_ACC0_ID\t7\t6\n");
  const Finished refused = run("--quiet");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr(file + ": exists and is not a file that truetriad exported"));
  EXPECT_EQ(TemporaryFolder::Read(file), "1\t1\tCAL_ACC0_ID\t7\t6\n");
  EXPECT_EQ(run("--overwrite").exit_code, 0);
  EXPECT_EQ(run("--quiet").exit_code, 0);
  const Finished calibrated = RunTruetriad(
      {"calibrate", "datasets/demo/recording.csv", "--to=c-header", "--output=" + folder.Path("")});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
  EXPECT_FALSE(std::filesystem::exists(file));  // It was exported of another result.
  folder.Write("calibration.h", "mine");
  const Finished again = RunTruetriad(
      {"calibrate", "datasets/demo/recording.csv", "--to=c-header", "--output=" + folder.Path("")});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_EQ(TemporaryFolder::Read(folder.Path("calibration.h")), "mine");
}

TEST(ExportVerb, WarnsEvenWhereItIsToBeQuiet) {
  const TemporaryFolder folder;
  const Finished run = RunTruetriad({"export",
                                     std::string("--calibration=") + kDemo,
                                     "--to=px4",
                                     "--quiet",
                                     "--output=" + folder.Path("unit.params")});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, AllOf(HasSubstr("warning: "), HasSubstr("PX4 uses these values only if")));
  EXPECT_THAT(run.err, Not(HasSubstr("note:")));
}

TEST(ExportVerb, RefusesACalibrationThatIsNotUsable) {
  const TemporaryFolder folder;
  std::string text = TemporaryFolder::Read(std::string(TRUETRIAD_SOURCE_DIR "/") + kDemo);
  text.replace(text.find("NO_LIMITS"), 9, "NO_RESULT");
  text.replace(text.find("converged"), 9, "not_observable");
  text.replace(text.find("sensors:"), text.find("quality:") - text.find("sensors:"), "");
  const std::string file = folder.Write("calibration.yaml", text);
  const Finished run = RunTruetriad(
      {"export", "--calibration=" + file, "--to=c-header", "--output=" + folder.Path("unit.h")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr(file), HasSubstr("not usable (not_observable)")));
  EXPECT_EQ(folder.FileCount(), 1U);
}

TEST(ImportVerb, WritesWhatCompareAndApplyTake) {
  const TemporaryFolder folder;
  const std::string carried = folder.Path("imu.yaml");
  ASSERT_EQ(RunTruetriad({"export",
                          std::string("--calibration=") + kDemo,
                          "--to=kalibr-result",
                          "--output=" + carried})
                .exit_code,
            0);
  const Finished run = RunTruetriad(
      {"import", "--from=kalibr", "--input=" + carried, "--output=" + folder.Path("back")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string file = folder.Path("back/calibration.yaml");
  EXPECT_EQ(run.out, file + "\n");
  EXPECT_THAT(run.err, IsEmpty());
  const Finished compared = RunTruetriad({"compare", std::string("--a=") + kDemo, "--b=" + file});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  // Neither has a σ; the values are the same to the last digit.
  EXPECT_THAT(compared.out,
              AllOf(HasSubstr("no common parameter with a σ"),
                    HasSubstr("accelerometer.sensitivity.zx        -0.009        -0.009")));
}

TEST(ImportVerb, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  const Finished missing = RunTruetriad({"import",
                                         "--from=px4",
                                         "--input=" + folder.Path("none.params"),
                                         "--output=" + folder.Path("back")});
  EXPECT_EQ(missing.exit_code, 2);
  const Finished format = RunTruetriad({"import",
                                        "--from=json",
                                        std::string("--input=") + kDemo,
                                        "--output=" + folder.Path("back")});
  EXPECT_EQ(format.exit_code, 1);
  EXPECT_THAT(format.err, HasSubstr("`json` cannot be imported"));
  EXPECT_EQ(folder.FileCount(), 0U);
}

TEST(ExportVerb, RefusesWhatDoesNotFitItsFlags) {
  const TemporaryFolder folder;
  const auto error = [&folder](const std::string& flag) {
    const Finished run = RunTruetriad({"export",
                                       std::string("--calibration=") + kDemo,
                                       "--output=" + folder.Path("unit"),
                                       flag,
                                       flag.starts_with("--to") ? "--instance=0" : "--to=px4"});
    EXPECT_EQ(run.exit_code, 1) << flag;
    return run.err;
  };
  EXPECT_THAT(error("--to=px5"), HasSubstr("did you mean `px4`?"));
  EXPECT_THAT(error("--units=g"), HasSubstr("is in m/s^2 and cannot be changed"));
  EXPECT_THAT(error("--units=furlong"), HasSubstr("`furlong` is not a unit"));
  EXPECT_THAT(error("--instance=4"), HasSubstr("px4 has sensors 0 to 3"));
  EXPECT_THAT(error("--id=compass:3"), HasSubstr("`compass` is not a sensor"));
  EXPECT_THAT(error("--id=1,2,3"), HasSubstr("has a number without a sensor"));
  EXPECT_THAT(error("--max-loss=much"), HasSubstr("`much` is not a valid number"));
  EXPECT_EQ(folder.FileCount(), 0U);
}

}  // namespace export_test
}  // namespace truetriad
