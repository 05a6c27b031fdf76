// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace verbs_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr char kJointExperiment[] = R"(experiment: 1
device: { serial: T1 }
reference: { field: { strength_ut: 48 } }
sensors: { accelerometer: {}, magnetometer: {} }
)";

/// One unit, recorded and calibrated twice.
class TwoCalibrations : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    folder_->Write("experiment.yaml", kJointExperiment);
    for (const std::uint64_t seed : {1U, 2U}) {
      const std::string name = std::to_string(seed);
      folder_->Write(name + ".csv", LogText(LogOptions{.seed = seed}));
      const Finished run = RunTruetriad({"calibrate",
                                         "--config=" + folder_->Path("experiment.yaml"),
                                         "--input=" + folder_->Path(name + ".csv"),
                                         "--output=" + folder_->Path(name)});
      ASSERT_EQ(run.exit_code, 0) << run.err;
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string Log(int i) { return folder_->Path(std::to_string(i) + ".csv"); }
  static std::string CalibrationFile(int i) {
    return folder_->Path(std::to_string(i)).append("/calibration.yaml");
  }

  static TemporaryFolder* folder_;
};
TemporaryFolder* TwoCalibrations::folder_ = nullptr;

TEST_F(TwoCalibrations, ApplyMakesGravityTheSameInEveryRest) {
  const std::string corrected = folder_->Path("corrected.csv");
  const Finished run = RunTruetriad({"apply",
                                     "--calibration=" + CalibrationFile(1),
                                     "--input=" + Log(2),
                                     "--output=" + corrected});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(run.err, HasSubstr("4200 rows"));
  std::istringstream rows(TemporaryFolder::Read(corrected));
  std::string row;
  std::getline(rows, row);
  EXPECT_EQ(row,
            "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],mag_x[uT],mag_y[uT],mag_z[uT]");
  for (int i = 0; std::getline(rows, row); ++i) {
    constexpr int kRowsARest = 125;
    constexpr int kRowsAPeriod = 175;
    if (i % kRowsAPeriod >= kRowsARest) continue;
    double time = 0.0, x = 0.0, y = 0.0, z = 0.0;
    ASSERT_EQ(std::sscanf(row.c_str(), "%lf,%lf,%lf,%lf", &time, &x, &y, &z), 4);
    // A sample scatters by 0.02 m/s^2; 6 sigma.
    EXPECT_NEAR(std::hypot(x, y, z), 9.80665, 0.12) << row;
  }
}

TEST_F(TwoCalibrations, ApplyRefusesALogInAnotherUnit) {
  const std::string log = folder_->Write(
      "counts.csv", "time[s],accel_x[counts],accel_y[counts],accel_z[counts]\n0,0,0,1\n");
  const std::string corrected = folder_->Path("counts-corrected.csv");
  const Finished run = RunTruetriad(
      {"apply", "--calibration=" + CalibrationFile(1), "--input=" + log, "--output=" + corrected});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("counts"), HasSubstr("m/s^2")));
  EXPECT_FALSE(std::filesystem::exists(corrected));
}

TEST_F(TwoCalibrations, ApplyDoesNotReplaceTheLogThatAManifestNames) {
  const std::string rows = "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n0,0,0,9.8\n";
  const std::string log = folder_->Write("named.csv", rows);
  const std::string manifest = folder_->Write(
      "named.yaml",
      "recording: 1\napplied: none\nstreams:\n  accelerometer: { file: named.csv, time: { column: "
      "\"time[s]\", unit: s }, x: \"accel_x[m/s^2]\", y: \"accel_y[m/s^2]\", "
      "z: \"accel_z[m/s^2]\", unit: m/s^2 }\n");
  const Finished run = RunTruetriad(
      {"apply", "--calibration=" + CalibrationFile(1), "--input=" + manifest, "--output=" + log});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("would be overwritten"));
  EXPECT_EQ(TemporaryFolder::Read(log), rows);
}

TEST_F(TwoCalibrations, ApplyLeavesNothingBehindWhenItIsInterrupted) {
  // Five million rows take seconds; the signal comes once the output has been begun.
  const std::string folder = folder_->Path("interrupted");
  std::filesystem::create_directories(folder);
  const std::string log = folder_->Path("long.csv");
  const Finished run = RunShell(
      "{ { echo 'time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]'; "
      "yes 1,0,0,9.8 | head -n 5000000; } >'" +
      log + "'; '" TRUETRIAD_BINARY "' apply --calibration='" + CalibrationFile(1) + "' --input='" +
      log + "' --output='" + folder +
      "/corrected.csv' & apply=$!; "
      "while kill -0 $apply && [ -z \"$(ls '" +
      folder +
      "')\" ]; do sleep 0.02; done; "
      "kill -TERM $apply; wait $apply; echo $?; }");
  EXPECT_EQ(run.out, "143\n") << run.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove(log);
}

TEST_F(TwoCalibrations, EvaluateFindsTheOtherRecordingAsPredicted) {
  const Finished run =
      RunTruetriad({"evaluate", "--calibration=" + CalibrationFile(1), "--input=" + Log(2)});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("AS PREDICTED"), HasSubstr("24 poses")));
}

TEST(EvaluateVerb, PredictsGravityAfterEachTurnWithAGyroscope) {
  const TemporaryFolder folder;
  const std::string source = TRUETRIAD_SOURCE_DIR;
  const Finished made = RunTruetriad({"calibrate",
                                      "--config=" + source + "/configs/experiments/nine-axis.yaml",
                                      "--output=" + folder.Path("nine"),
                                      "--report=false"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("23 turns held out once: median error"));
  const Finished run = RunTruetriad({"evaluate",
                                     "--calibration=" + folder.Path("nine/calibration.yaml"),
                                     "--input=" + source + "/datasets/demo/recording.csv"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("NOT A TEST: the calibration was made from this recording"),
                    HasSubstr("Gravity after a turn"),
                    HasSubstr("predicted by each of 23 turns")));
}

TEST_F(TwoCalibrations, EvaluateHasNothingToSayWithoutRests) {
  const std::string log =
      folder_->Write("moving.csv", LogText(LogOptions{.rests = 40, .rest_s = 0.0}));
  const Finished run =
      RunTruetriad({"evaluate", "--calibration=" + CalibrationFile(1), "--input=" + log});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("no rest"));
}

TEST_F(TwoCalibrations, CompareFindsThemInAgreement) {
  const Finished run =
      RunTruetriad({"compare", "--a=" + CalibrationFile(1), "--b=" + CalibrationFile(2)});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("AGREE"), Not(HasSubstr("DISAGREE"))));
}

TEST_F(TwoCalibrations, OtherVerbsWriteAPageToo) {
  const auto page_of = [](std::vector<std::string> call) {
    const std::string page = folder_->Path("pages/page.html");
    call.push_back("--report=" + page);
    const Finished run = RunTruetriad(call);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("Report: " + page));
    return TemporaryFolder::Read(page);
  };
  EXPECT_THAT(
      page_of({"inspect", Log(1)}),
      AllOf(HasSubstr("<b>ENOUGH for a usable calibration</b>"), HasSubstr("Is it enough?")));
  EXPECT_THAT(page_of({"evaluate", CalibrationFile(1), Log(2)}),
              AllOf(HasSubstr("AS PREDICTED"), HasSubstr("Worst poses")));
  EXPECT_THAT(page_of({"compare", CalibrationFile(1), CalibrationFile(2)}),
              AllOf(HasSubstr("AGREE"), HasSubstr("accelerometer.bias.x")));
  // What was refused is said there, too.
  const std::string page = folder_->Path("short.html");
  const Finished run =
      RunTruetriad({"inspect",
                    folder_->Write("short.csv", LogText({.rests = 16, .rest_s = 0.3})),
                    "--report=" + page});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(TemporaryFolder::Read(page), HasSubstr("NOT ENOUGH"));
}

TEST_F(TwoCalibrations, ReportMakesTheSamePageAgainButForTheRecording) {
  const std::string page = folder_->Path("again.html");
  const Finished run =
      RunTruetriad({"report", "--calibration=" + CalibrationFile(1), "--output=" + page});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::string first = TemporaryFolder::Read(folder_->Path("1/report.html"));
  const std::string end = "<!-- /sources -->\n";
  const std::size_t recording = first.find("<!-- sources -->");
  ASSERT_NE(recording, std::string::npos);
  EXPECT_NE(first.find("<h2>The recording over time</h2>", recording), std::string::npos);
  first.erase(recording, first.find(end, recording) + end.size() - recording);
  EXPECT_EQ(TemporaryFolder::Read(page), first);
}

TEST_F(TwoCalibrations, ReportMakesOnePageForEachOfSeveral) {
  const std::string pages = folder_->Path("pages");
  for (const std::vector<std::string>& list :
       {std::vector{"--calibration=" + CalibrationFile(1) + "," + CalibrationFile(2)},
        std::vector{"--calibration=" + CalibrationFile(1), CalibrationFile(2)}}) {
    std::vector<std::string> arguments = {"report", "--output=" + pages};
    arguments.insert(arguments.end(), list.begin(), list.end());
    const Finished run = RunTruetriad(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, pages + "/T1.html\n" + pages + "/T1-2.html\n");
  }
  EXPECT_TRUE(std::filesystem::exists(pages + "/T1-2.html"));
}

TEST_F(TwoCalibrations, ReportRefusesOnePageForSeveral) {
  const Finished run =
      RunTruetriad({"report",
                    "--calibration=" + CalibrationFile(1) + "," + CalibrationFile(2),
                    "--output=" + folder_->Path("one.html")});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("name a folder"));
}

TEST_F(TwoCalibrations, InspectPrintsTheSameWhereverThePosesComeFrom) {
  const Finished detected = RunTruetriad({"inspect", "--input=" + Log(1)});
  EXPECT_EQ(detected.exit_code, 0) << detected.err;
  EXPECT_THAT(detected.err, IsEmpty());
  EXPECT_THAT(detected.out, HasSubstr("24 poses by static detection"));
  std::string ranges = "poses:\n";
  for (int k = 0; k < 24; ++k) {
    ranges += "  - { first: " + std::to_string(175 * k) +
              ", last: " + std::to_string(175 * k + 124) + " }\n";
  }
  folder_->Write("poses.yaml", ranges);
  const Finished given =
      RunTruetriad({"inspect", "--input=" + Log(1), "--poses=file:" + folder_->Path("poses.yaml")});
  EXPECT_EQ(given.exit_code, 0) << given.err;
  EXPECT_THAT(given.out, HasSubstr("24 poses by given row ranges"));
}

TEST_F(TwoCalibrations, InspectSaysWhatItCanWithoutRests) {
  const std::string log =
      folder_->Write("still-moving.csv", LogText(LogOptions{.rests = 40, .rest_s = 0.0}));
  const Finished run = RunTruetriad({"inspect", "--input=" + log});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, AllOf(HasSubstr("0 poses"), HasSubstr("magnetometer"), HasSubstr("2000")));
  EXPECT_THAT(run.err, HasSubstr("no rest found"));
}

}  // namespace verbs_test
}  // namespace truetriad
