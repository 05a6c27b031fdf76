// SPDX-License-Identifier: Apache-2.0
// A fleet whose logs arrive, are measured again, and wait for a golden unit.
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace fleet_watch_test {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// Waits until FILE has COUNT lines with TEXT.
constexpr char kLines[] = "lines() { await \"[ \\$(grep -c -- '$2' '$1') -ge $3 ]\"; }; ";

class FleetWatch : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_.Path("line")); }

  std::string Log(const std::string& name, std::uint64_t seed, LogOptions options = {}) const {
    options.magnetometer = false;
    options.rests = 12;
    options.seed = seed;
    return folder_.Write(name + ".csv", LogText(options));
  }
  /// A line of shell in the folder, with `truetriad` in it.
  Finished Run(const std::string& line) const {
    return RunShell(std::string(kLines) + "truetriad() { '" TRUETRIAD_BINARY "' \"$@\"; }; " + line,
                    folder_.Path(""));
  }
  /// The lines of the answer below its header.
  std::vector<std::string> Ask(const std::string& sql) const {
    const Finished run = Run("truetriad fleet query --csv --store=out/fleet.db \"" + sql + "\"");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::istringstream text(run.out);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    if (!lines.empty()) lines.erase(lines.begin());
    return lines;
  }

  const TemporaryFolder folder_;
};

TEST_F(FleetWatch, CalibratesWhatIsThereWhatArrivesAndWhatArrivesAgain) {
  Log("line/u0", 1);
  Log("u1", 2);
  Log("again", 3);
  const Finished run =
      Run("{ '" TRUETRIAD_BINARY
          "' fleet watch line/ -o out --report=false --json --progress=jsonl 2>err & watch=$!; "
          "lines err '\"verdict\"' 1; cp u1.csv line/; lines err '\"verdict\"' 2; "
          "cp again.csv line/u0.csv; lines err '\"verdict\"' 3; "
          "truetriad fleet watch line -o out >/dev/null; echo $? >second; "
          "kill -TERM $watch; wait $watch; }");
  EXPECT_EQ(run.exit_code, 0) << run.err << TemporaryFolder::Read(folder_.Path("err"));
  EXPECT_THAT(Ask("SELECT serial, count(*) FROM run GROUP BY serial ORDER BY serial"),
              ElementsAre("u0,2", "u1,1"));
  // One tool has the output.
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("second")), "2\n");
  EXPECT_THAT(run.err, HasSubstr("in use by another fleet watch"));
  const auto result = nlohmann::json::parse(run.out, nullptr, false);
  ASSERT_FALSE(result.is_discarded()) << run.out;
  EXPECT_EQ(result["result"]["done"], 3);
  EXPECT_TRUE(result["result"]["units"].is_null());
  EXPECT_EQ(result["result"]["yield"]["units"], 2);
  std::istringstream lines(TemporaryFolder::Read(folder_.Path("err")));
  int done = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto object = nlohmann::json::parse(line, nullptr, false);
    ASSERT_FALSE(object.is_discarded()) << line;
    if (!object.contains("run")) continue;
    EXPECT_EQ(object["done"], ++done);
  }
  EXPECT_EQ(done, 3);
}

TEST_F(FleetWatch, GoesOnWhereItEnded) {
  Log("line/u0", 1);
  const std::string watch = "truetriad fleet watch line -o out --report=false --until-idle=0.1";
  EXPECT_THAT(Run(watch).out, StartsWith("ALL USABLE, NO LIMITS SET"));
  EXPECT_THAT(Run(watch).out, StartsWith("NOTHING TO DO"));
  Log("line/deep", 2);
  EXPECT_THAT(Run(watch + " --poll=0.1").out, HasSubstr("  1 unit in"));
  EXPECT_THAT(Run("truetriad fleet run line -o out --report=false --resume").out,
              StartsWith("NOTHING TO DO"));
  EXPECT_THAT(Ask("SELECT run FROM run"), SizeIs(2));
}

// A table that never came is a red row with its code, not silence.
TEST_F(FleetWatch, EndsWithARunOfARecordingThatIsIncomplete) {
  Log("line/u0", 1);
  fs::create_directories(folder_.Path("line/u1"));
  folder_.Write("line/u1/recording.yaml",
                "recording: 1\napplied: none\nstreams:\n  accelerometer: { file: imu.csv, time: { "
                "column: t, unit: s }, x: x, y: y, z: z, unit: m/s^2 }\n");
  const std::string watch =
      "truetriad fleet watch line -o out --report=false --poll=0.1 --until-idle=0.1 ";
  EXPECT_THAT(Run(watch).out, StartsWith("1 OF 2 NOT GOOD"));
  EXPECT_THAT(Ask("SELECT serial, code FROM run ORDER BY serial"),
              ElementsAre("u0,", "u1,unreadable-file"));
  EXPECT_THAT(Run(watch + "--tag=lot=L17").out,
              AllOf(StartsWith("1 OF 2 SKIPPED UNITS NOT GOOD"), HasSubstr("  0 units in")));
}

TEST_F(FleetWatch, TellsTheOperatorOfEachUnitInALine) {
  Log("line/good", 1);
  LogOptions poor;
  poor.rest_s = 0.3;  // No rest is found in it.
  Log("line/poor", 2, poor);
  const std::string watch =
      "truetriad fleet watch line -o out --report=false --until-idle=0.1 --jobs=1 ";
  const Finished run = Run(watch);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("good  NO LIMITS SET\n"),
                    HasSubstr("poor  NO RESULT  record again; do not touch the unit while it rests "
                              "(no-rest)")));
  EXPECT_THAT(Run(watch + "--set=limits.accelerometer.bias=1e-9").err,
              HasSubstr("good  FAIL  set it aside (limit:accelerometer.bias."));
}

TEST_F(FleetWatch, TellsTheOperatorWhatAPersonDecided) {
  Log("line/u1", 1);
  const std::string watch =
      "truetriad fleet watch line -o out --report=false --until-idle=0.1 --jobs=1 ";
  ASSERT_EQ(Run(watch).exit_code, 0);
  const std::string refuse = "truetriad fleet dispose u1 --store=out/fleet.db --verdict=FAIL ";
  ASSERT_EQ(Run(refuse + "--who=QA --why='cracked case'").exit_code, 0);
  // Also where nothing of it is to be done.
  const Finished left_out = Run(watch + "--fail-on=unit --json");
  EXPECT_EQ(left_out.exit_code, 4);
  const auto result = nlohmann::json::parse(left_out.out, nullptr, false)["result"];
  EXPECT_EQ(result["skipped"], 1);
  EXPECT_THAT(result["skipped_not_good"], ElementsAre("u1"));
  Run("touch line/u1.csv");
  EXPECT_THAT(Run(watch).err, HasSubstr("u1  FAIL by QA (cracked case): set it aside\n"));
  // A packed log is of the same unit.
  Run("gzip line/u1.csv");
  ASSERT_EQ(Run(watch).exit_code, 0);
  EXPECT_THAT(Ask("SELECT DISTINCT serial FROM run"), ElementsAre("u1"));
}

TEST_F(FleetWatch, SaysWhatIsWrongWithTheCall) {
  folder_.Write("one.yaml",
                "experiment: 1\ndevice: { serial: A1 }\nsensors: { accelerometer: {} }\n");
  const Finished same = Run("truetriad fleet watch line -o out -c one.yaml");
  EXPECT_EQ(same.exit_code, 1);
  EXPECT_THAT(same.err, HasSubstr("one.yaml:2: device.serial is `A1`"));
  EXPECT_FALSE(fs::exists(folder_.Path("out")));
  EXPECT_EQ(Run("truetriad fleet watch").exit_code, 1);
  EXPECT_EQ(Run("truetriad fleet watch nowhere").exit_code, 2);
  EXPECT_EQ(Run("truetriad fleet watch line --poll=0").exit_code, 1);
  EXPECT_EQ(Run("truetriad fleet watch line --until-idle=x").exit_code, 1);
  EXPECT_EQ(Run("truetriad fleet watch line --serial=x").exit_code, 1);
  EXPECT_EQ(Run("truetriad fleet watch line --require-golden=8h").exit_code, 1);
}

TEST_F(FleetWatch, CountsRetestsAsThePolicyOfTheStoreSays) {
  Log("line/u0", 1);
  LogOptions poor;
  poor.rest_s = 0.3;  // No rest is found in it.
  Log("line/u1", 2, poor);
  const std::string run = "truetriad fleet run line -o out --report=false ";
  const Finished first = Run(run + "--retest-counts=best --retest-most=1");
  EXPECT_THAT(first.out, HasSubstr("First-pass yield 50.0 %, final 50.0 % of 2 units"));
  Log("line/u1", 2);
  const Finished second = Run(run);
  EXPECT_THAT(second.out, HasSubstr("First-pass yield 50.0 %, final 100.0 % of 2 units"));
  EXPECT_THAT(second.err, IsEmpty());
  // The same recordings again are no attempts.
  EXPECT_THAT(Run(run).err, IsEmpty());
  Log("line/u1", 3);
  EXPECT_THAT(
      Run(run).err,
      HasSubstr("u1: this is recording 3 of the unit; the store keeps it, but only the first "
                "2 recordings can decide the unit's verdict"));
  const Finished other = Run(run + "--retest-counts=last");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("state the same"));
  EXPECT_EQ(Run(run + "--retest-counts=some").exit_code, 1);
  EXPECT_EQ(Run(run + "--retest-most=-1").exit_code, 1);
}

TEST_F(FleetWatch, WaitsForAStationWhoseGoldenUnitIsOverdue) {
  Log("golden", 5);
  Log("earlier", 6);
  Log("line/u0", 1);
  LogOptions bent;
  bent.accelerometer.bias.x() += 0.2;
  Log("bent", 7, bent);
  ASSERT_EQ(Run("truetriad calibrate golden.csv -o ref").exit_code, 0);
  const std::string check =
      "truetriad check-station --golden=ref/calibration.yaml --store=out/fleet.db ";
  const std::string run =
      "truetriad fleet run line -o out --report=false --require-golden=8h --tag=station=S3 ";
  EXPECT_THAT(Run(check + "today.csv").err, HasSubstr("--tag=station=NAME"));
  const Finished missing = Run(run + "--json");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.out,
              AllOf(HasSubstr("station-not-checked"), HasSubstr("no check of its golden unit")));
  EXPECT_EQ(Run(check + "bent.csv --tag=station=S3").exit_code, 4);
  EXPECT_THAT(Run(run).err, HasSubstr("did not agree"));
  // The same recording, granted more: no other measurement.
  const Finished again =
      Run(check + "bent.csv --tag=station=S3 --repeatability=accelerometer.bias=1 --json");
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.out, AllOf(HasSubstr("\"first_check\""), HasSubstr("\"agrees\": false")));
  EXPECT_THAT(Run(run).err, HasSubstr("did not agree"));
  // Another one, of before it did not agree.
  const Finished old =
      Run("touch -d '9 hours ago' earlier.csv; " + check + "earlier.csv --tag=station=S3 --json");
  EXPECT_EQ(old.exit_code, 4);
  EXPECT_THAT(old.out, HasSubstr("\"later_check\""));
  EXPECT_THAT(Run(run).err, HasSubstr("did not agree"));
  // The watch waits until somebody has checked, or nothing else comes.
  const Finished idle =
      Run("truetriad fleet watch line -o out --report=false --require-golden=8h --tag=station=S3 "
          "--until-idle=0.1 --poll=0.1 --json");
  EXPECT_EQ(idle.exit_code, 2);
  EXPECT_THAT(idle.out,
              AllOf(HasSubstr("station-not-checked"),
                    HasSubstr("1 log not calibrated"),
                    HasSubstr("\"verdicts\"")));
  const Finished ended =
      Run("{ '" TRUETRIAD_BINARY
          "' fleet watch line -o out --report=false --require-golden=8h --tag=station=S3 2>err & "
          "watch=$!; lines err 'calibration waits' 1; kill -TERM $watch; wait $watch; code=$?; "
          "cat err >&2; (exit $code); }");
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, HasSubstr("1 log not calibrated"));
  Log("today", 8);
  const Finished watched =
      Run("{ '" TRUETRIAD_BINARY
          "' fleet watch line -o out --report=false --require-golden=8h --tag=station=S3 2>err & "
          "watch=$!; lines err 'calibration waits' 1; " +
          check + "today.csv --tag=station=S3 >/dev/null; lines err 'calibration continues' 1; " +
          "await '[ -e out/units/u0 ]'; "
          "kill -TERM $watch; wait $watch; }");
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  EXPECT_THAT(watched.out, StartsWith("ALL USABLE, NO LIMITS SET"));
  EXPECT_EQ(Run(run).exit_code, 0);
  // A list that says another station of a unit.
  EXPECT_THAT(
      Run("printf 'log,station\\nline/u0.csv,S4\\n' > list.csv; truetriad fleet run list.csv "
          "-o out --report=false --require-golden=8h --tag=station=S3")
          .err,
      HasSubstr("station S4 has no check"));
  // Where it says one of each unit, no other need be named.
  EXPECT_EQ(Run("printf 'log,station\\nline/u0.csv,S3\\n' > list.csv; truetriad fleet run list.csv "
                "-o out --report=false --require-golden=8h")
                .exit_code,
            0);
  EXPECT_THAT(Run(run + "--require-golden=0.0001s").err, HasSubstr("given twice"));
  EXPECT_THAT(
      Ask("SELECT station, agrees, repeatability FROM station_check ORDER BY station_check"),
      ElementsAre("S3,0,", "S3,1,accelerometer.bias=1", "S3,1,", "S3,1,"));
  EXPECT_THAT(Run("truetriad check-station --golden=ref/calibration.yaml today.csv "
                  "--tag=station=S3 --store=checks.jsonl")
                  .err,
              HasSubstr("cannot hold station checks"));
  EXPECT_FALSE(fs::exists(folder_.Path("checks.jsonl")));
}

}  // namespace fleet_watch_test
}  // namespace truetriad
