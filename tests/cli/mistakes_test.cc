// SPDX-License-Identifier: Apache-2.0
//
// What people get wrong on their first day, each with the exit status, the code and the words that
// it is answered by.
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace mistakes_test {

using nlohmann::json;
using ::testing::HasSubstr;

const LogOptions kSmall{.rests = 12, .magnetometer = false};

const std::string& GoodLog() {
  static const std::string text = LogText(kSmall);
  return text;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string WithHeader(const std::string& header) {
  return header + GoodLog().substr(GoodLog().find('\n'));
}

// The good log with a line in place of one of its lines (1 = header).
std::string WithLine(std::size_t number, const std::string& line) {
  std::string text = GoodLog();
  std::size_t begin = 0;
  for (std::size_t i = 1; i < number; ++i) begin = text.find('\n', begin) + 1;
  return text.replace(begin, text.find('\n', begin) - begin, line);
}

std::string InUtf16(const std::string& text) {
  std::string wide = "\xFF\xFE";
  for (const char c : text) wide += {c, '\0'};
  return wide;
}

struct Mistake {
  std::string name;
  std::string text;                    // of the log; FOLDER/log.csv
  std::vector<std::string> arguments;  // LOG and FOLDER stand for those; empty: calibrate LOG
  int exit_code = 2;
  std::string code = {};         // of the error, or of the first refusal
  std::string message = {};      // what it says, among others
  int line = 0;                  // that it names
  std::string file = "log.csv";  // that LOG is

  friend std::ostream& operator<<(std::ostream& out, const Mistake& mistake) {
    return out << mistake.name;
  }
};

class TypicalMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(TypicalMistake, IsNamedByItsCodeAndLeavesNothing) {
  const Mistake& mistake = GetParam();
  const TemporaryFolder folder;
  folder.Write(mistake.file, mistake.text);
  folder.Write("good.csv", GoodLog());
  std::vector<std::string> arguments = mistake.arguments;
  if (arguments.empty()) arguments = {"calibrate", "LOG", "-o", "FOLDER/result"};
  for (std::string& argument : arguments) {
    argument = Replaced(argument, "LOG", folder.Path(mistake.file));
    argument = Replaced(argument, "FOLDER", folder.Path("."));
  }
  arguments.emplace_back("--json");
  const std::size_t files = folder.FileCount();
  const Finished run = RunTruetriad(arguments);
  EXPECT_EQ(run.exit_code, mistake.exit_code) << run.out << run.err;
  const json said = json::parse(run.out, nullptr, false);
  ASSERT_FALSE(said.is_discarded()) << run.out;
  if (said.contains("error")) {
    const json& error = said["error"];
    EXPECT_EQ(error["code"], mistake.code) << error["message"];
    EXPECT_THAT(error["message"].get<std::string>(), HasSubstr(mistake.message));
    EXPECT_EQ(mistake.line > 0 ? error.value("line", 0) : 0, mistake.line) << error;
    EXPECT_EQ(folder.FileCount(), files);
    return;
  }
  if (mistake.code.empty()) return;
  std::string seen;
  for (const json& finding : said["findings"]) {
    seen += finding["code"].get<std::string>() + ": " + finding["text"].get<std::string>() + '\n';
  }
  EXPECT_THAT(seen, HasSubstr(mistake.code + ": "));
  EXPECT_THAT(seen, HasSubstr(mistake.message));
}

std::string Experiment(const std::string& more) { return "experiment: 1\n" + more; }

std::vector<Mistake> Mistakes() {
  const std::vector<std::string> by_experiment = {
      "calibrate", "FOLDER/good.csv", "-c", "LOG", "-o", "FOLDER/result"};
  const auto with = [](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"calibrate", "FOLDER/good.csv", "-o", "FOLDER/result"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  const auto with_serial = [&](const std::string& serial) {
    return with({"--set=device.serial=" + serial});
  };
  const std::string accelerometer = "sensors: { accelerometer: {} }\n";
  return {
      // Files.
      {"WrongPath", "", {"calibrate", "FOLDER/lgo.csv"}, 2, "unreadable-file", "lgo.csv"},
      {"FolderForAFile", "", {"calibrate", "FOLDER"}, 2, "unreadable-file", "is a folder"},
      {"EmptyFile", "", {}, 2, "empty-file", "is empty"},
      {"Picture", std::string("\x89PNG\r\n\x1a\n\0\0\0\0", 12), {}, 2, "wrong-format", "CSV text"},
      {"Page", "<!DOCTYPE html>\n<html><body>404</body></html>\n", {}, 2, "wrong-format", "HTML"},
      {"Utf16", InUtf16(GoodLog()), {}, 2, "wrong-format", "UTF-16"},
      {"ByteOrderMark", "\xEF\xBB\xBF" + GoodLog(), {}, 0},
      {"CutOff", GoodLog().substr(0, 5000) + "12.3", {}, 2, "damaged-file", "truncated"},
      {"ExperimentForALog",
       Experiment(accelerometer),
       {"calibrate", "LOG", "-o", "FOLDER/result"},
       2,
       "wrong-format",
       "--config",
       0,
       "unit.yaml"},
      // Headers.
      {"NoHeader", WithHeader("0,1,2,3"), {}, 2, "no-header", "name the columns"},
      {"HeaderAlone",
       WithHeader("").substr(0, 0) + LogHeader(kSmall),
       {},
       2,
       "no-readings",
       "rows"},
      {"DuplicateColumn",
       WithHeader("time[s],accel_x[m/s^2],accel_x[m/s^2],accel_z[m/s^2]"),
       {},
       2,
       "duplicate-column",
       "occurs twice",
       1},
      {"MissingAxis",
       WithHeader("time[s],accel_x[m/s^2],accel_y[m/s^2],weight[kg]"),
       {},
       2,
       "missing-column",
       "accel_z",
       1},
      {"MissingUnit",
       WithHeader("time[s],accel_x,accel_y,accel_z"),
       {},
       2,
       "missing-unit",
       "accel_x[m/s^2]",
       1},
      {"UnknownUnit",
       WithHeader("time[s],accel_x[ft/s2],accel_y[ft/s2],accel_z[ft/s2]"),
       {},
       2,
       "unknown-unit",
       "m/s^2",
       1},
      {"TwoUnits",
       WithHeader("time[s],accel_x[m/s^2],accel_y[g],accel_z[m/s^2]"),
       {},
       2,
       "unit-mismatch",
       "one unit for all axes",
       1},
      {"MisspeltColumns", WithHeader("t,ax,ay,az"), {}, 2, "unknown-column", "accel_x", 1},
      // Rows.
      {"DecimalComma",
       Replaced(Replaced(GoodLog(), ",", ";"), ".", ","),
       {},
       2,
       "unreadable-number",
       "decimal point",
       2},
      {"Percent", WithLine(7, "0.1,1,2,3%"), {}, 2, "unreadable-number", "3%", 7},
      {"Text", WithLine(7, "0.1,1,2,three"), {}, 2, "unreadable-number", "three", 7},
      {"Infinite", WithLine(7, "0.1,1,2,inf"), {}, 2, "unreadable-number", "inf", 7},
      {"MissingField", WithLine(7, "0.1,1,2"), {}, 2, "wrong-field-count", "expected 4", 7},
      {"PastedTogether", GoodLog() + GoodLog(), {}, 0, "joined-recording", "joined"},
      {"Tabs", Replaced(GoodLog(), ",", "\t"), {}, 0},
      {"DosLines", Replaced(GoodLog(), "\n", "\r\n"), {}, 0},
      {"QuotedFields",
       WithHeader(R"("time[s]","accel_x[m/s^2]","accel_y[m/s^2]","accel_z[m/s^2]")"),
       {},
       0},
      // Units and sensors.
      {"MetresStatedAsG",
       WithHeader("time[s],accel_x[g],accel_y[g],accel_z[g]"),
       {},
       3,
       "wrong-unit",
       "wrong"},
      {"MillisecondsStatedAsSeconds",
       WithHeader("time[us],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]"),
       {},
       3,
       "wrong-unit",
       "coarser"},
      {"TooFewPoses", LogText({.rests = 4, .magnetometer = false}), {}, 3, "too-few-poses", "4"},
      {"FlatTable",
       LogText({.rests = 16, .in_one_plane = true, .magnetometer = false}),
       {},
       3,
       "too-few-directions",
       "plane"},
      // Experiments.
      {"TabInYaml",
       Experiment("sensors:\n\taccelerometer: {}\n"),
       by_experiment,
       2,
       "bad-yaml",
       "tab",
       3},
      {"UnknownKey",
       Experiment(accelerometer + "gravty: 9.8\n"),
       by_experiment,
       2,
       "unknown-key",
       "gravty",
       3},
      {"DuplicateKey",
       Experiment(accelerometer + accelerometer),
       by_experiment,
       2,
       "duplicate-key",
       "twice",
       3},
      {"WrongType",
       Experiment("sensors: { accelerometer: { model: 7 } }\n"),
       by_experiment,
       2,
       "invalid-value",
       "model",
       2},
      {"NoYaml", "[1, 2", by_experiment, 2, "bad-yaml", "YAML"},
      {"MissingSensor",
       Experiment("sensors: { magnetometer: {} }\n"),
       by_experiment,
       2,
       "missing-sensor",
       "magnetometer"},
      {"UnknownLimit",
       Experiment(accelerometer + "limits: { accelerometer.bais: 0.1 }\n"),
       by_experiment,
       2,
       "unknown-key",
       "bias",
       3},
      {"SerialWithSlashes", "", with_serial("\"a/b\\\\c\""), 0},
      {"SerialWithQuotes", "", with_serial("a\"b"), 0},
      {"SerialOfFourHundredLetters",
       "",
       with_serial(std::string(400, 'x')),
       2,
       "invalid-value",
       "serial"},
      {"SerialOfTwoLines", "", with_serial("\"a\\nb\""), 2, "invalid-value", "serial"},
      // Calls.
      {"UnknownVerb", "", {"calibrte", "LOG"}, 1, "unknown-verb", "calibrate"},
      {"UnknownFlag", "", with({"--confg=x"}), 1, "unknown-flag", "--config"},
      {"NoValue", "", with({"--tag="}), 1, "missing-argument", "--tag"},
      {"OverrideWithoutKey", "", with({"--set=gravity"}), 1, "invalid-argument", "key.sub=value"},
      {"UnknownTag", "", with({"--tag=lott=7"}), 1, "invalid-argument", "mean `lot`"},
      {"TagWithoutValue", "", with({"--tag=lot"}), 1, "invalid-argument", "has no value"},
      {"TagsInOneFlag", "", with({"--tag=lot=7,slot=3"}), 1, "invalid-argument", "--tag=slot=3"},
      {"FileForAFolder",
       "",
       {"calibrate", "FOLDER/good.csv", "-o", "FOLDER/good.csv"},
       2,
       "output-in-the-way",
       "good.csv"},
      {"NoSuchFolderToWriteTo",
       "",
       {"calibrate", "FOLDER/good.csv", "-o", "/proc/result"},
       2,
       "cannot-write",
       "/proc"},
      {"LogForACalibration",
       GoodLog(),
       {"export", "--calibration=LOG", "--to=px4", "-o", "FOLDER/result"},
       2,
       "bad-yaml",
       "log.csv"},
      {"UnknownFormat",
       "",
       {"export",
        "--calibration=" TRUETRIAD_SOURCE_DIR "/datasets/demo/truth.yaml",
        "--to=px5",
        "-o",
        "FOLDER/result"},
       1,
       "unknown-name",
       "px4"},
  };
}

INSTANTIATE_TEST_SUITE_P(Each,
                         TypicalMistake,
                         ::testing::ValuesIn(Mistakes()),
                         [](const auto& test) { return test.param.name; });

}  // namespace mistakes_test
}  // namespace truetriad
