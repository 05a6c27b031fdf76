// SPDX-License-Identifier: Apache-2.0
// Fleets in shards, brought together, and given to other programs.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace fleet_shards_test {

namespace fs = std::filesystem;

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class FleetShards : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_.Path("line"));
    for (int i = 0; i < 6; ++i) {
      LogOptions options;
      options.magnetometer = false;
      options.rests = i == 3 ? 2 : 12;  // One is refused.
      options.seed = static_cast<std::uint64_t>(i + 1);
      folder_.Write("line/u" + std::to_string(i) + ".csv", LogText(options));
    }
  }
  /// `truetriad fleet LINE`, in the folder.
  Finished Fleet(const std::string& line) const {
    return RunShell("'" TRUETRIAD_BINARY "' fleet " + line, folder_.Path(""));
  }
  void RunShards(int count) const {
    for (int i = 0; i < count; ++i) {
      const std::string shard = std::to_string(i), n = std::to_string(count);
      const Finished run = Fleet("run line -o out --report=false --shard=" + shard + "/" + n +
                                 " --store=out/" + shard + ".jsonl");
      ASSERT_EQ(run.exit_code, 0) << run.err;
    }
  }
  /// What is in a store, without what differs from run to run.
  std::string Content(const std::string& store) const {
    std::string text;
    for (const char* const sql :
         {"SELECT serial, log, verdict, code, message, effective_dof, "
          "covariance FROM run ORDER BY serial",
          "SELECT serial, name, value, sigma FROM run JOIN parameter USING "
          "(run) ORDER BY serial, place",
          "SELECT serial, finding.code, text, remedy FROM run JOIN finding USING "
          "(run) ORDER BY serial, place"}) {
      const Finished run = Fleet("query --csv --store=" + store + " \"" + sql + "\"");
      EXPECT_EQ(run.exit_code, 0) << run.err;
      text += run.out;
    }
    return text;
  }

  const TemporaryFolder folder_;
};

TEST_F(FleetShards, TogetherAreWhatASingleRunIs) {
  ASSERT_EQ(Fleet("run line -o single --report=false").exit_code, 0);
  RunShards(3);
  const Finished collected = Fleet("collect out/0.jsonl out/1.jsonl out/2.jsonl --store=all.db");
  EXPECT_EQ(collected.exit_code, 0) << collected.err;
  EXPECT_THAT(collected.out, StartsWith("6 runs in 3 sources, 6 of them new"));
  EXPECT_EQ(collected.err, "");
  EXPECT_EQ(Content("all.db"), Content("single/fleet.db"));
  // Nothing is missing, so nothing is done again.
  EXPECT_THAT(Fleet("run line -o out --report=false --shard=1/3 --store=out/1.jsonl --resume").out,
              StartsWith("NOTHING TO DO"));
  // One SQLite store into another.
  EXPECT_THAT(Fleet("collect single/fleet.db --store=copy.db").out, HasSubstr("6 of them new"));
  EXPECT_EQ(Content("copy.db"), Content("single/fleet.db"));
}

TEST_F(FleetShards, AreNotJudgedByDifferentLimitsInSilence) {
  for (const std::string shard : {"0", "1"}) {
    EXPECT_EQ(Fleet("run line -o out --report=false --shard=" + shard + "/2 --store=out/" + shard +
                    ".jsonl --set=limits.accelerometer.bias=" + (shard == "0" ? "4" : "5"))
                  .exit_code,
              0);
  }
  EXPECT_THAT(Fleet("collect out/0.jsonl out/1.jsonl --store=all.db").err,
              HasSubstr("the units were judged by different limits of accelerometer.bias"));
}

// In both kinds of store.
TEST_F(FleetShards, TakeNoCopyForAnotherUnit) {
  for (const std::string store : {"out/0.jsonl", "out/fleet.db"}) {
    // What was there before is what it was; of two that come at once neither is known to be it.
    fs::remove(folder_.Path("line/v1.csv"));
    ASSERT_EQ(Fleet("run line/u1.csv -o out --store=" + store).exit_code, 0);
    fs::copy(folder_.Path("line/u1.csv"), folder_.Path("line/v1.csv"));
    const Finished run = Fleet("run line/v1.csv -o out --store=" + store);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("line/v1.csv: has the same readings as line/u1.csv"));
    const Finished both = Fleet("run line -o both --store=both" + store.substr(3));
    EXPECT_THAT(both.err, HasSubstr("line/v1.csv: has the same readings as line/u1.csv"));
    EXPECT_THAT(both.err, HasSubstr("line/u1.csv: has the same readings as line/v1.csv"));
  }
  EXPECT_THAT(Fleet("query --csv --store=out/fleet.db \"SELECT DISTINCT serial, verdict, code, "
                    "folder = '' FROM run WHERE serial LIKE '%1'\"")
                  .out,
              HasSubstr("\nu1,NO_LIMITS,,0\nv1,NO_RESULT,other-device,1\n"));
  // Wherever the other log is now, until a person says that its number was wrong, as advised.
  fs::rename(folder_.Path("line/u1.csv"), folder_.Path("u1.csv"));
  fs::rename(folder_.Path("line/v1.csv"), folder_.Path("line/w1.csv"));
  const std::string copy = Fleet("run line/w1.csv -o out").err;
  const std::size_t advised = copy.find("`truetriad fleet ");
  ASSERT_NE(advised, std::string::npos) << copy;
  const std::string command = copy.substr(advised + 17, copy.find('`', advised + 1) - advised - 17);
  EXPECT_THAT(command, AllOf(HasSubstr("--wrong-serial --run=2"), HasSubstr("--why='is w1'")));
  const Finished bent =
      Fleet("dispose u1 --store=out/fleet.db --who=Roe --verdict=FAIL --why=bent");
  EXPECT_EQ(bent.exit_code, 0) << bent.err;
  EXPECT_EQ(Fleet("run line/w1.csv -o out").err, copy);
  const Finished said = Fleet(command);
  EXPECT_EQ(said.exit_code, 0) << command << said.err;
  EXPECT_THAT(said.out, StartsWith("u1 is FAIL, its serial number was wrong (run "));
  EXPECT_EQ(Fleet("run line/w1.csv -o out").exit_code, 0);
  const Finished back = Fleet("dispose u1 --store=out/fleet.db --who=Roe --verdict=PASS --why=it");
  EXPECT_EQ(back.exit_code, 1);
  EXPECT_THAT(back.err, HasSubstr("its readings belong to unit `w1`"));
  // Of both, the one whose number was wrong is the copy.
  fs::rename(folder_.Path("u1.csv"), folder_.Path("line/u1.csv"));
  EXPECT_THAT(
      Fleet("run line/u1.csv line/w1.csv -o out").err,
      StartsWith("u1: NO RESULT, other-device: line/u1.csv: has the same readings as line/w1"));
  EXPECT_THAT(Fleet("query --csv --store=out/fleet.db \"SELECT serial, verdict FROM latest\"").out,
              AllOf(HasSubstr("u1,NO_RESULT"), HasSubstr("w1,NO_LIMITS")));
  const std::string again = "dispose u1 --store=out/fleet.db --who=Roe --verdict=FAIL --why=bent";
  EXPECT_EQ(Fleet(again).exit_code, 0);
  EXPECT_EQ(Fleet("run line/w1.csv -o out").exit_code, 0);
  EXPECT_THAT(Fleet(again + " --wrong-serial=false").err,
              HasSubstr("its readings belong to unit `w1`"));
  // Once they count for no other unit, they are given back.
  EXPECT_EQ(
      Fleet("dispose w1 --store=out/fleet.db --who=Roe --verdict=FAIL --why=u1 --wrong-serial")
          .exit_code,
      0);
  EXPECT_THAT(Fleet(again + " --wrong-serial=false").out,
              StartsWith("u1 is FAIL, its serial number was right (run "));
}

// However each of them spells the folder.
TEST_F(FleetShards, TakeEachUnitOnce) {
  const std::string whole = fs::canonical(folder_.Path("line")).string();
  for (const auto& [shard, line] :
       {std::pair("0", std::string("./line/")),
        {"1", whole},
        {"2", "../" + fs::canonical(folder_.Path("")).filename().string() + "/line"}}) {
    ASSERT_EQ(Fleet("run " + line + " -o out --report=false --shard=" + shard + "/3 --store=out/" +
                    shard + ".jsonl")
                  .exit_code,
              0);
  }
  ASSERT_EQ(Fleet("collect out/0.jsonl out/1.jsonl out/2.jsonl --store=all.db").exit_code, 0);
  EXPECT_EQ(
      Fleet("query --csv --store=all.db \"SELECT count(*), count(DISTINCT serial) FROM run\"").out,
      "count(*),count(DISTINCT serial)\n6,6\n");
}

TEST_F(FleetShards, ThatAreNotFinishedAreNotCollected) {
  RunShards(2);
  const std::string file = folder_.Path("out/0.jsonl"), text = TemporaryFolder::Read(file);
  folder_.Write("out/0.jsonl", text.substr(0, text.find('\n') + 1));
  const Finished refused = Fleet("collect out/0.jsonl out/1.jsonl --store=all.db");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("out/0.jsonl: has 0 runs"), HasSubstr("--resume")));
  EXPECT_FALSE(fs::exists(folder_.Path("all.db")));
  const Finished told =
      Fleet("collect out/0.jsonl out/1.jsonl --store=some.db --unfinished --json");
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(json::parse(told.out)["result"]["unfinished"], ElementsAre("out/0.jsonl"));
  ASSERT_EQ(
      Fleet("run line -o out --report=false --shard=0/2 --store=out/0.jsonl --resume").exit_code,
      0);
  EXPECT_THAT(Fleet("collect out/0.jsonl out/1.jsonl --store=all.db").out,
              StartsWith("6 runs in 2 sources"));
}

TEST_F(FleetShards, ThatAreMissingAreNamed) {
  RunShards(2);
  const Finished collected = Fleet("collect out/1.jsonl --store=all.db --json");
  EXPECT_EQ(collected.exit_code, 0);
  EXPECT_THAT(collected.err, HasSubstr("no file and no run of shard 0 of 2"));
  EXPECT_THAT(json::parse(collected.out)["result"]["missing"], ElementsAre(0));
}

TEST_F(FleetShards, SayWhatIsWrongWithTheCall) {
  RunShards(2);
  const Finished question = Fleet("query --store=out/0.jsonl \"SELECT 1\"");
  EXPECT_EQ(question.exit_code, 2);
  EXPECT_THAT(question.err, HasSubstr("truetriad fleet collect out/0.jsonl --store="));
  EXPECT_THAT(Fleet("run line -o out --shard=1/2 --store=out/0.jsonl").err,
              HasSubstr("give each shard a file of its own"));
  EXPECT_EQ(Fleet("collect --store=all.db").exit_code, 1);
  EXPECT_EQ(Fleet("collect out/0.jsonl --store=out/all.jsonl").exit_code, 1);
  EXPECT_EQ(Fleet("collect missing.jsonl --store=all.db").exit_code, 2);
  EXPECT_EQ(Fleet("collect line/u0.csv --store=all.db").exit_code, 2);
  EXPECT_FALSE(fs::exists(folder_.Path("all.db")));
  ASSERT_EQ(Fleet("collect out/0.jsonl out/1.jsonl --store=all.db").exit_code, 0);
  for (const auto& [flags, message] : std::vector<std::pair<std::string, std::string>>{
           {"--to=xlsx -o x", "--to"},
           {"--to=csv -o x --runs=some", "--runs=some"},
           {"--to=csv -o x --where='verdic = 1'", "is not valid"},
           {"--to=csv -o all.db", "would be overwritten, and it is an input"},
           {"--to=parquet -o all.db", "would be overwritten, and it is an input"}}) {
    const Finished run = Fleet("export --store=all.db " + flags);
    EXPECT_THAT(run.exit_code, ::testing::AnyOf(1, 2)) << flags;
    EXPECT_THAT(run.err, HasSubstr(message)) << flags;
  }
  EXPECT_FALSE(fs::exists(folder_.Path("x")));
  EXPECT_EQ(Fleet("export --store=sqlite:all.db --to=csv -o all.db").exit_code, 1);
}

TEST_F(FleetShards, AreExportedAsTheyAre) {
  RunShards(2);
  ASSERT_EQ(Fleet("collect out/0.jsonl out/1.jsonl --store=all.db").exit_code, 0);
  const Finished lines = Fleet("export --store=all.db --to=jsonl --runs=all -o all.jsonl");
  EXPECT_EQ(lines.out, "all.jsonl: 6 runs\n") << lines.err;
  ASSERT_EQ(Fleet("collect all.jsonl --store=again.db").exit_code, 0);
  EXPECT_EQ(Content("again.db"), Content("all.db"));
  const Finished csv =
      Fleet("export --store=all.db --to=csv --where=\"verdict = 'NO_LIMITS'\" -o t.csv --json");
  EXPECT_EQ(json::parse(csv.out)["result"],
            json({{"file", "t.csv"}, {"format", "csv"}, {"runs", 5}}));
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("t.csv")),
              AllOf(StartsWith("run,serial,created,verdict,final_verdict,first_verdict,"),
                    HasSubstr(",accelerometer.bias.x,accelerometer.bias.x.sigma,")));
}

}  // namespace fleet_shards_test
}  // namespace truetriad
