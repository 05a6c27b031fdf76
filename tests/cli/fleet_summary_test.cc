// SPDX-License-Identifier: Apache-2.0
// What a line's engineer asks of the store that `fleet run` has written.
#include <cstdio>
#include <filesystem>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace fleet_summary_test {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Units of two operators, each recorded twice by both.
class FleetSummary : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    std::filesystem::create_directories(folder_->Path("line"));
    std::string list = "log,serial,operator,note\n";
    int seed = 0;
    for (const char* unit : {"u1", "u2", "'u3"}) {
      for (const char* by : {"Ann", "Bo"}) {
        for (int repeat = 0; repeat < 2; ++repeat) {
          LogOptions options;
          options.magnetometer = false;
          options.rests = 12;
          options.seed = static_cast<std::uint64_t>(++seed);
          const std::string log = "line/" + std::to_string(seed) + ".csv";
          folder_->Write(log, LogText(options));
          list += log + ',' + unit + ',' + by + ",study\n";
        }
      }
    }
    folder_->Write("line/few.csv", LogText({.rests = 2}));
    list += "line/few.csv,few,,\n";
    folder_->Write("list.csv", list);
    const Finished run =
        RunShell("'" TRUETRIAD_BINARY
                 "' fleet run list.csv --report=false -o day --set=limits.accelerometer.bias=0.25",
                 folder_->Path(""));
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  static void TearDownTestSuite() { delete folder_; }

  static Finished Summary(const std::string& flags) {
    return RunShell("'" TRUETRIAD_BINARY "' fleet summary --store=day/fleet.db " + flags,
                    folder_->Path(""));
  }

  static TemporaryFolder* folder_;
};
TemporaryFolder* FleetSummary::folder_ = nullptr;

TEST_F(FleetSummary, AnswersInTheOrderOfAsking) {
  const Finished run = Summary("");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("0 OF 4 GOOD"));
  std::size_t last = 0;
  for (const char* part : {"3 units measured again, 13 recordings in all",
                           "Why units are not good",
                           "limit:accelerometer.bias.z",
                           "Distributions against limits",
                           "accelerometer.bias.x",
                           "Capability"}) {
    const std::size_t at = run.out.find(part);
    ASSERT_NE(at, std::string::npos) << part << "\n" << run.out;
    EXPECT_GE(at, last) << part;
    last = at;
  }
}

TEST_F(FleetSummary, IsWhatItsSchemaSays) {
  const Finished run =
      Summary("--json --points=5 --study=\"note = 'study' AND serial <> 'few'\" > summary.json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json object =
      nlohmann::json::parse(TemporaryFolder::Read(folder_->Path("summary.json")));
  const nlohmann::json& result = object["result"];
  EXPECT_EQ(result["yield"]["units"], 4);
  EXPECT_EQ(result["limits"].size(), 3u);
  EXPECT_EQ(result["study"]["runs"], 12);
  EXPECT_EQ(result["study"]["quantities"][0]["gauge"]["parts"], 3);
  EXPECT_EQ(result["study"]["quantities"][0]["gauge"]["appraisers"], 2);
  if (RunShell("python3 -c 'import jsonschema'").exit_code != 0) {
    GTEST_SKIP() << "python3-jsonschema is not installed: nothing was validated";
  }
  const Finished checked = RunShell(
      "python3 -c \"\n"
      "import json, pathlib, jsonschema\n"
      "folder = pathlib.Path('" TRUETRIAD_SOURCE_DIR
      "/share/truetriad/schema')\n"
      "schemas = {n: json.loads((folder / n).read_text()) for n in ('calibration.json', "
      "'output.json')}\n"
      "schema = schemas['output.json']\n"
      "resolver = jsonschema.RefResolver(base_uri='output.json', referrer=schema, store=schemas)\n"
      "text = json.loads(pathlib.Path('summary.json').read_text())\n"
      "for error in jsonschema.Draft202012Validator(schema, resolver=resolver).iter_errors(text):\n"
      "    print(list(error.absolute_path), error.message[:300])\n"
      "\"",
      folder_->Path(""));
  EXPECT_EQ(checked.exit_code, 0) << checked.err;
  EXPECT_EQ(checked.out, "");
}

/// A summary without what differs from one call to the next: the times that the work took.
std::string WithoutWork(const std::string& text) {
  static const std::regex kWork(
      "[0-9.]+ s a\\s+unit, [0-9.]+ s of a\\s+processor|\"(wall|cpu)_s\": *[^,}]*");
  return std::regex_replace(text, kWork, "");
}

// 26 recordings of 24 units whose bias drifts, listed as they were measured and the other way
// round: once the list says when, once the files do.
TEST(FleetSummaryOfAList, FollowsTheTimeOfMeasurementWhateverTheOrderOfTheList) {
  const TemporaryFolder folder;
  std::vector<std::string> lines;
  for (int i = 0; i < 26; ++i) {
    LogOptions options;
    options.magnetometer = false;
    options.rests = 12;
    options.rest_s = 1.5;
    options.accelerometer.bias.x() += 0.01 * i;
    options.seed = static_cast<std::uint64_t>(i + 1);
    const std::string log = "u" + std::to_string(i * 7 % 26) + ".csv";
    const std::string path = folder.Write(log, LogText(options));
    char moment[64];
    std::snprintf(moment, sizeof moment, "2026-11-24T%02d:30:00Z", i % 24);
    if (i >= 24) moment[9] = '5';
    lines.push_back(log + ",S" + std::to_string(i % 24) + ',' + moment + '\n');
    ASSERT_EQ(RunShell("touch -d " + std::string(moment) + " '" + path + "'").exit_code, 0);
  }
  const auto summary = [&](const std::string& name, bool is_reversed, bool is_stated) {
    std::string list = is_stated ? "log,serial,recorded\n" : "log,serial\n";
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const std::string& line = lines[is_reversed ? lines.size() - 1 - k : k];
      list += is_stated ? line : line.substr(0, line.rfind(',')) + '\n';
    }
    folder.Write(name + ".csv", list);
    const Finished run = RunShell(
        "'" TRUETRIAD_BINARY "' fleet run " + name + ".csv --report=false --jobs=2 -o " + name +
            " --set=limits.accelerometer.bias=0.45 >&2 && '" TRUETRIAD_BINARY
            "' fleet summary --store=" +
            name + "/fleet.db && '" TRUETRIAD_BINARY "' fleet summary --json --points=50 --store=" +
            name + "/fleet.db",
        folder.Path(""));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return WithoutWork(run.out);
  };
  const std::string stated = summary("stated", false, true);
  EXPECT_THAT(stated, HasSubstr("24 units dated by the"));
  EXPECT_THAT(stated, HasSubstr("\"first\": \"2026-11-24T02:30:00Z\""));
  EXPECT_EQ(stated, summary("stated-reversed", true, true));
  const std::string filed = summary("filed", false, false);
  EXPECT_THAT(filed, HasSubstr("\"file\": 24"));
  EXPECT_EQ(filed, summary("filed-reversed", true, false));
}

// A log whose clock counts from 1970 says itself when it was recorded.
TEST(FleetSummaryOfAList, TakesARecordingsOwnTime) {
  const TemporaryFolder folder;
  const LogOptions options{.rests = 12, .magnetometer = false};
  std::vector<LogRow> rows = LogRows(options);
  for (LogRow& row : rows) row[0] += 1'795'500'000.0;
  folder.Write("u1.csv", LogText(LogHeader(options), rows));
  folder.Write("list.csv", "log,serial,recorded\nu1.csv,u1,\n");
  const Finished run = RunShell(
      "'" TRUETRIAD_BINARY "' fleet run list.csv --report=false -o day >&2 && '" TRUETRIAD_BINARY
      "' fleet query --csv --store=day/fleet.db 'SELECT recorded, recorded_by FROM run'",
      folder.Path(""));
  EXPECT_EQ(run.out, "recorded,recorded_by\n2026-11-24T06:00:00Z,recording\n") << run.err;
}

TEST_F(FleetSummary, IsATableOfQuantitiesAsCsv) {
  const Finished run = Summary("--csv");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(StartsWith("name,kind,unit,units,mean,"),
                    HasSubstr("\naccelerometer.bias.x,limit,m/s^2,3,"),
                    HasSubstr("\naccelerometer.bias.x,parameter,,3,")));
}

TEST_F(FleetSummary, SaysWhatIsWrongWithTheCall) {
  const std::map<std::string, std::string> mistakes = {
      {"--where=\"lots = 1\"", "lots"},
      {"--study=\"note = 'none'\"", "the condition of the study selects no run"},
      {"--study=\"serial = 'u1'\" --reference=accelerometer.bias.w=1", "accelerometer.bias.w"},
      {"--study=\"serial = 'u1'\" --reference=accelerometer.bias.x", "expected a quantity"},
      {"--reference=accelerometer.bias.x=1", "--study"},
      {"--golden-due=0h", "--golden-due"},
      {"--points=-1", "--points"},
      {"--baseline=19", "expected 20 units or more"},
      {"--study=\"run IN (SELECT run FROM tag WHERE value IN ('Ann', 'Bo')) AND log <> "
       "'line/1.csv'\"",
       "1 run of part u1 by Ann, but up to 2 in other cells"},
  };
  for (const auto& [flags, message] : mistakes) {
    const Finished run = Summary(flags);
    EXPECT_THAT(run.exit_code, AnyOf(1, 2, 3)) << flags;
    EXPECT_THAT(run.err, HasSubstr(message)) << flags;
    EXPECT_EQ(run.out, "") << flags;
  }
}

}  // namespace fleet_summary_test
}  // namespace truetriad
