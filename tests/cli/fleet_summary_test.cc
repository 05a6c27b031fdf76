// SPDX-License-Identifier: Apache-2.0
// What a line's engineer asks of the store that `fleet run` has written.
#include <filesystem>
#include <map>
#include <string>

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
      {"--study=\"note = 'none'\"", "no run is one of the study"},
      {"--study=\"serial = 'u1'\" --reference=accelerometer.bias.w=1", "accelerometer.bias.w"},
      {"--study=\"serial = 'u1'\" --reference=accelerometer.bias.x", "expected a quantity"},
      {"--reference=accelerometer.bias.x=1", "--study"},
      {"--golden-due=0h", "--golden-due"},
      {"--points=-1", "--points"},
      {"--baseline=19", "expected 20 units or more"},
      {"--study=\"run IN (SELECT run FROM tag WHERE value IN ('Ann', 'Bo')) AND log <> "
       "'line/1.csv'\"",
       "1 run of part u1 by Ann, elsewhere 2"},
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
