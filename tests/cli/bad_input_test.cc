// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace bad_input_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const LogOptions kSmall{.rests = 12, .magnetometer = false};
constexpr int kAccelX = 1;

/// A log of which `change` has spoiled the rows.
std::string Spoiled(const std::function<void(std::vector<LogRow>*)>& change) {
  std::vector<LogRow> rows = LogRows(kSmall);
  change(&rows);
  return LogText(LogHeader(kSmall), rows);
}

/// A good log with `line` in place of one of its lines (1 = header).
std::string WithLine(std::size_t number, const std::string& line) {
  std::string text = LogText(kSmall);
  std::size_t begin = 0;
  for (std::size_t i = 1; i < number; ++i) begin = text.find('\n', begin) + 1;
  return text.replace(begin, text.find('\n', begin) - begin, line);
}

struct BadLog {
  std::string name;
  std::string text;
  std::vector<std::string> message;  ///< What it must hold.

  friend std::ostream& operator<<(std::ostream& out, const BadLog& log) { return out << log.name; }
};

class BadInput : public ::testing::TestWithParam<BadLog> {};

TEST_P(BadInput, IsRefusedAndNothingIsWritten) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", GetParam().text);
  const std::string config = folder.Write("experiment.yaml", kAccelerometerExperiment);
  const std::size_t files = folder.FileCount();
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + config,
                                     "--input=" + log,
                                     "--output=" + folder.Path("deep/result")});
  EXPECT_EQ(run.exit_code, 2) << run.out;
  EXPECT_THAT(run.out, IsEmpty());
  for (const std::string& part : GetParam().message) EXPECT_THAT(run.err, HasSubstr(part));
  EXPECT_EQ(folder.FileCount(), files);
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    BadInput,
    ::testing::Values(
        BadLog{"MissingUnit",
               WithLine(1, "time[s],accel_x,accel_y[m/s^2],accel_z[m/s^2]"),
               {"log.csv", "accel_x", "unit"}},
        BadLog{"UnknownUnit",
               WithLine(1, "time[s],accel_x[furlong],accel_y[furlong],accel_z[furlong]"),
               {"log.csv", "furlong", "m/s^2"}},
        BadLog{"UnknownColumn",
               LogText("time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],a[uT],b[uT],c[uT]\n",
                       LogRows({.rests = 12})),
               {"log.csv:1", "columns `a`, `b`, `c` are unknown"}},
        BadLog{"RaggedRow", WithLine(7, "0.1,1,2"), {"log.csv:7"}},
        BadLog{"TextInANumber", WithLine(7, "0.1,1,2,three"), {"log.csv:7", "three"}},
        BadLog{"InfiniteReading", WithLine(7, "0.1,1,2,inf"), {"log.csv:7", "inf"}},
        BadLog{"EmptyFile", "", {"log.csv", "empty"}},
        BadLog{"HeaderAlone", LogHeader(kSmall), {"log.csv", "no rows"}},
        BadLog{"NotANumberEverywhere",
               Spoiled([](auto* rows) {
                 for (LogRow& row : *rows) row[kAccelX] = std::nan("");
               }),
               {"log.csv", "no reading"}},
        BadLog{"StuckSamples",
               Spoiled([](auto* rows) {
                 for (LogRow& row : *rows) row = {row[0], 1.0, 2.0, 9.0};
               }),
               {"log.csv", "stuck"}},
        BadLog{"ClippedAxis",
               Spoiled([](auto* rows) {
                 for (LogRow& row : *rows) row[kAccelX] = std::clamp(row[kAccelX], -0.5, 0.5);
               }),
               {"log.csv", "x axis at its limit of 0.5 m/s^2", "full-scale range"}},
        BadLog{"TimeGoingBackwards",
               Spoiled([](auto* rows) { std::swap((*rows)[100], (*rows)[200]); }),
               {"log.csv:", "backwards"}},
        BadLog{"RowsOfATablePastedTwice",
               "accel_x[g],accel_y[g],accel_z[g]\n1,0,0\n0,1,0\n1,0,0\n0,1,0\n",
               {"log.csv", "lines 2 and 4"}},
        BadLog{
            "HalfWrittenFile", LogText(kSmall).substr(0, 5000) + "12.3", {"log.csv", "truncated"}},
        BadLog{"BinaryFile", std::string("\x89PNG\r\n\x1a\n\0\0\0\0", 12), {"log.csv"}}),
    [](const auto& test) { return test.param.name; });

/// A run of calibrate with everything good but what the test changes.
class BadCall : public ::testing::Test {
 protected:
  Finished Calibrate(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {
        "calibrate", "--config=" + config_, "--input=" + log_, "--output=" + output_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunTruetriad(arguments);
  }

  TemporaryFolder folder_;
  std::string log_ = folder_.Write("log.csv", LogText(kSmall));
  std::string config_ = folder_.Write("experiment.yaml", kAccelerometerExperiment);
  std::string output_ = folder_.Path("result");
};

TEST_F(BadCall, NamesALogThatIsNotThere) {
  log_ = folder_.Path("nowhere.csv");
  const Finished run = Calibrate();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("nowhere.csv"), HasSubstr("No such file")));
}

TEST_F(BadCall, NamesAFolderGivenAsALog) {
  log_ = folder_.Path(".");
  const Finished run = Calibrate();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("folder"));
}

TEST_F(BadCall, RefusesAnOutputThatCannotBeAFolder) {
  // Below a regular file: not even root can write there.
  output_ = log_ + "/result";
  const Finished run = Calibrate();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(run.err, AllOf(HasSubstr(log_ + ":"), HasSubstr("is a file; name a folder")));
}

TEST_F(BadCall, ListsEveryWrongTypeOfAnExperimentWithItsLine) {
  config_ = folder_.Write("experiment.yaml", R"(experiment: 1
reference: { gravity_mps2: heavy }
sensors:
  accelerometer: { model: [full] }
)");
  const Finished run = Calibrate();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("experiment.yaml:2"),
                    HasSubstr("heavy"),
                    HasSubstr("experiment.yaml:4"),
                    HasSubstr("model")));
  EXPECT_FALSE(std::filesystem::exists(output_));
}

TEST_F(BadCall, RefusesAnUnknownKeyInAnOverride) {
  const Finished run = Calibrate({"--set=robust.los=none"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("los"));
}

TEST_F(BadCall, AsksForALogWhenNobodyNamedOne) {
  const Finished run = RunTruetriad({"calibrate", "--config=" + config_, "--output=" + output_});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("--input=LOG"));
}

TEST_F(BadCall, CountsAttitudesAndPosesThatDoNotMatch) {
  folder_.Write("attitudes.csv",
                "accel_x[g],accel_y[g],accel_z[g],qw,qx,qy,qz\n0,0,1,1,0,0,0\n0,1,0,1,0,0,0\n");
  const Finished run = Calibrate({"--set=attitudes={file: attitudes.csv}"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("2 rows"), HasSubstr("12 poses")));
}

TEST_F(BadCall, RefusesToHoldCountsOfUnknownSizeAtIdentity) {
  log_ = folder_.Write(
      "log.csv",
      LogText("time[s],accel_x[counts],accel_y[counts],accel_z[counts]\n", LogRows(kSmall)));
  const Finished run = Calibrate({"--set=sensors.accelerometer.model=bias"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("si_per_count"));
}

TEST(Contradiction, InAnExperimentIsNamedWithItsLine) {
  const TemporaryFolder folder;
  const std::string config = folder.Write("experiment.yaml",
                                          "experiment: 1\n"
                                          "sensors:\n"
                                          "  magnetometer: {}\n"
                                          "  gyroscope:\n"
                                          "    g_sensitivity: true\n");
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + config,
                                     "--input=datasets/demo/recording.csv",
                                     "--output=" + folder.Path("out")});
  const Finished check = RunTruetriad({"check", config});
  for (const Finished& finished : {run, check}) {
    EXPECT_EQ(finished.exit_code, 2);
    EXPECT_THAT(finished.err, HasSubstr("experiment.yaml:5: gyroscope: g-sensitivity needs"));
  }
}

TEST(EveryRow, OfALogOfAGyroscopeIsRefusedWithAdvice) {
  const TemporaryFolder folder;
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=configs/experiments/nine-axis.yaml",
                                     "--set=poses=every_row",
                                     "--output=" + folder.Path("out")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("poses: every_row"), HasSubstr("motion")));
}

TEST(EveryRow, OfALogWithoutTimesIsRefusedByEveryVerb) {
  const TemporaryFolder folder;
  std::string text = LogHeader(kSmall);
  text.erase(0, text.find(',') + 1);
  std::vector<LogRow> rows = LogRows(kSmall);
  for (LogRow& row : rows) row.erase(row.begin());
  const std::string log = folder.Write("log.csv", LogText(text, rows));
  for (const std::string verb : {"inspect", "calibrate", "init"}) {
    const Finished run = RunTruetriad({verb, log});
    EXPECT_EQ(run.exit_code, 2) << verb << run.out;
    EXPECT_THAT(run.err, AllOf(HasSubstr("no time column"), HasSubstr("rate_hz: 100"))) << verb;
  }
}

}  // namespace bad_input_test
}  // namespace truetriad
