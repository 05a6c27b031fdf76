// SPDX-License-Identifier: Apache-2.0
#include "fleet/collect.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/json_lines.h"
#include "fleet/run_samples.h"
#include "fleet/run_table.h"
#include "fleet/store.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace collect_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Collecting : public ::testing::Test {
 protected:
  /// A store of `shard` with these runs, of units of their own.
  std::string Written(const std::string& name,
                      const Shard& shard,
                      const std::vector<std::string>& ids) {
    const Result<std::unique_ptr<Store>> store = OpenStore(folder_.Path(name));
    EXPECT_TRUE(store) << store.error().message;
    EXPECT_TRUE((*store)->StateShard(shard));
    for (const std::string& id : ids) {
      UnitRun run = SampleRun(id, "unit '" + id);
      run.shard = ShardText(shard);
      EXPECT_TRUE((*store)->Add(run));
    }
    EXPECT_TRUE((*store)->MarkEnd());
    return folder_.Path(name);
  }
  /// All that is in a store, as lines.
  std::vector<std::string> Lines(const std::string& url) {
    std::vector<std::string> lines;
    const auto take = [&](const UnitRun& run) -> Status {
      lines.push_back(LineOf(run));
      return {};
    };
    if (JsonLinesPath(url)) {
      EXPECT_TRUE(ForEachLine(url, take));
      return lines;
    }
    const Result<std::unique_ptr<Store>> store = OpenStoreToRead(url);
    EXPECT_TRUE(store) << store.error().message;
    EXPECT_TRUE((*store)->ForEachRun({}, take));
    return lines;
  }

  const TemporaryFolder folder_;
  const std::string target_ = folder_.Path("all.db");
};

TEST_F(Collecting, BringsWholeRunsTogetherAndDoesItAgain) {
  const std::vector<std::string> sources = {Written("0.jsonl", {0, 3}, {"1", "4"}),
                                            Written("1.jsonl", {1, 3}, {"2"}),
                                            Written("2.db", {2, 3}, {"3"})};
  const Result<Collected> first = Collect(sources, target_);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->runs, 4u);
  EXPECT_EQ(first->added, 4u);
  EXPECT_EQ(first->shards, 3);
  EXPECT_THAT(first->missing, IsEmpty());
  std::vector<std::string> expected;
  for (const std::string& source : sources) {
    for (const std::string& line : Lines(source)) expected.push_back(line);
  }
  EXPECT_THAT(Lines(target_), ::testing::UnorderedElementsAreArray(expected));
  const Result<Collected> second = Collect(sources, target_);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->added, 0u);
  EXPECT_EQ(Lines(target_).size(), 4u);
}

// Each shard sees its own units alone.
TEST_F(Collecting, NamesUnitsThatHaveTheReadingsOfAnother) {
  std::vector<std::string> sources;
  const auto write = [&](int shard, const std::string& serial, const std::string& log) {
    sources.push_back(folder_.Path(std::to_string(shard) + ".jsonl"));
    const Result<std::unique_ptr<Store>> store = OpenStore(sources.back());
    ASSERT_TRUE(store) << store.error().message;
    ASSERT_TRUE((*store)->StateShard({shard, 3}));
    UnitRun run = SampleRun(std::to_string(shard), serial);
    run.shard = ShardText({shard, 3});
    run.verdict = Verdict::kPass;
    run.log = log;
    run.readings = {{"accelerometer", "aa"}};
    ASSERT_TRUE((*store)->Add(run));
    ASSERT_TRUE((*store)->MarkEnd());
  };
  write(0, "A1", "a/recording.yaml");
  write(1, "B1", "b/recording.yaml");
  write(2, "A2", "a/recording.yaml");  // At another station, or with another serial number.
  const Result<Collected> collected = Collect(sources, target_);
  ASSERT_TRUE(collected) << collected.error().message;
  EXPECT_EQ(collected->added, 3u);
  const auto is_copy_of = [](const std::string& copy, const std::string& of) {
    return AllOf(HasSubstr("unit `" + copy + "` (run "),
                 HasSubstr("which belongs to unit `" + of + "`"));
  };
  EXPECT_THAT(collected->copies,
              ElementsAre(is_copy_of("B1", "A1"), is_copy_of("A2", "A1"), is_copy_of("A2", "B1")));
  // Until it is known which unit was measured, and the others are refused.
  const Result<std::unique_ptr<Store>> store = OpenStore(target_);
  ASSERT_TRUE(store);
  for (const bool wrong_serial : {false, true}) {
    ASSERT_TRUE(
        (*store)->Dispose({.id = SampleId(wrong_serial ? "d2" : "d1"),
                           .serial = "A1",
                           .created = "2026-11-25T00:00:00Z",
                           .who = "R. Roe",
                           .why = "not it",
                           .verdict = Verdict::kFail,
                           .wrong_serial = wrong_serial ? std::optional(true) : std::nullopt}));
    const Result<Collected> again = Collect(sources, target_);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_THAT(again->copies, ::testing::SizeIs(wrong_serial ? 1 : 3));
    EXPECT_THAT(again->copies.back(), is_copy_of("A2", "B1"));
  }
}

TEST_F(Collecting, SaysWhichDecisionAnotherStationsRecordingLifts) {
  const std::string source = Written("a.db", {}, {"1"}), later = folder_.Path("b.db");
  ASSERT_TRUE((*OpenStore(source))
                  ->Dispose({SampleId("d1"),
                             "unit '1",
                             "2026-11-25T12:00:00Z",
                             "me",
                             "scratched",
                             Verdict::kFail}));
  UnitRun run = SampleRun("e2", "unit '1");  // Begun after the decision.
  run.recorded = "2026-11-25T13:00:00Z";
  run.log = "later.csv";
  run.readings = {{"accelerometer", "bb"}};
  run.verdict = Verdict::kPass;
  ASSERT_TRUE((*OpenStore(later))->Add(run));
  const Result<Collected> collected = Collect({source, later}, target_);
  ASSERT_TRUE(collected) << collected.error().message;
  EXPECT_THAT(collected->notes,
              Contains(HasSubstr("unit '1: the decision of me (FAIL: scratched) does not hold")));
  // Nor does a run that is not good of what was measured before.
  UnitRun before = run;
  before.id = SampleId("e3");
  before.recorded = "2026-11-25T12:30:00Z";
  before.log = "before.csv";
  before.readings = {{"accelerometer", "cc"}};
  before.verdict = Verdict::kNoResult;
  ASSERT_TRUE((*OpenStore(later))->Add(before));
  EXPECT_THAT(Collect({later}, target_)->notes,
              Contains("unit '1: PASS by its current run " + run.id));
}

TEST_F(Collecting, NamesTheShardsThatAreMissing) {
  const std::string one = Written("1.jsonl", {1, 4}, {"1"}),
                    without_runs = Written("2.jsonl", {2, 4}, {});
  const Result<Collected> some = Collect({one, without_runs}, target_);
  ASSERT_TRUE(some) << some.error().message;
  EXPECT_THAT(some->missing, ElementsAre(0, 3));
  // What is in the store already is not missing.
  const Result<Collected> more = Collect({Written("3.jsonl", {3, 4}, {"2"})}, target_);
  ASSERT_TRUE(more);
  EXPECT_THAT(more->missing, ElementsAre(0, 2));
}

TEST_F(Collecting, TakesShardsOfOneNumber) {
  const std::string three = Written("a.jsonl", {0, 3}, {"1"}),
                    four = Written("b.jsonl", {1, 4}, {"2"});
  const Result<Collected> both = Collect({three, four}, target_);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message,
              HasSubstr("b.jsonl: states the shard count 4, but " + three + " states 3"));
  EXPECT_FALSE(std::filesystem::exists(target_));
  ASSERT_TRUE(Collect({three}, target_));
  const Result<Collected> other = Collect({four}, target_);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("its shard count is 3, not 4"));
}

TEST_F(Collecting, AddsNothingWhereASourceIsSpoilt) {
  const std::string good = Written("0.jsonl", {0, 2}, {"1"}),
                    bad = Written("1.jsonl", {1, 2}, {"2"});
  folder_.Write("1.jsonl", TemporaryFolder::Read(bad) + "{\n");
  const Result<Collected> collected = Collect({good, bad}, target_);
  ASSERT_FALSE(collected);
  EXPECT_EQ(collected.error().place.file, bad);
  EXPECT_EQ(collected.error().place.line, 4);
  EXPECT_FALSE(std::filesystem::exists(target_));
}

TEST_F(Collecting, TakesWhatIsNotFinishedOnlyWhenTold) {
  const std::string good = Written("0.jsonl", {0, 2}, {"1"}),
                    cut = Written("1.jsonl", {1, 2}, {"2", "3"});
  const std::string whole = TemporaryFolder::Read(cut);
  // At the end of any line, and within one.
  for (std::size_t size = whole.size() - 1; size > 0;
       size = whole.rfind('\n', size - 1) == std::string::npos ? 0 : whole.rfind('\n', size - 1)) {
    for (const std::size_t bytes : {size - 1, size + 1}) {
      if (bytes == whole.size()) continue;
      folder_.Write("1.jsonl", whole.substr(0, bytes));
      const Result<Collected> refused = Collect({good, cut}, target_);
      ASSERT_FALSE(refused) << bytes;
      EXPECT_EQ(refused.error().code, ErrorCode::kDamagedFile);
      EXPECT_THAT(refused.error().message, HasSubstr(cut + ": has "));
      EXPECT_FALSE(std::filesystem::exists(target_));
    }
  }
  const Result<Collected> told = Collect({good, cut}, target_, /*takes_unfinished=*/true);
  ASSERT_TRUE(told) << told.error().message;
  EXPECT_THAT(told->unfinished, ElementsAre(cut));
  folder_.Write("1.jsonl", whole);
  const Result<Collected> finished = Collect({good, cut}, target_);
  ASSERT_TRUE(finished) << finished.error().message;
  EXPECT_EQ(finished->added, 2u);
  // A line less in the middle.
  const std::size_t second = whole.find('\n') + 1, third = whole.find('\n', second) + 1;
  folder_.Write("1.jsonl", whole.substr(0, second) + whole.substr(third));
  EXPECT_THAT(
      Collect({good, cut}, target_).error().message,
      HasSubstr("states that 2 runs, 0 decisions and 0 checks of stations are on the lines above, "
                "but there are 1 runs"));
}

TEST_F(Collecting, IsIntoAnotherStore) {
  const std::string source = Written("0.jsonl", {}, {"1"});
  EXPECT_THAT(Collect({source}, source).error().message, HasSubstr("cannot be the target"));
  ASSERT_TRUE(Collect({source}, target_));
  std::filesystem::create_symlink("all.db", folder_.Path("link.db"));
  EXPECT_THAT(Collect({folder_.Path("link.db")}, "sqlite:" + target_).error().message,
              HasSubstr("is the target (--store) itself"));
}

TEST_F(Collecting, TakesDispositionsAndChecksOfStationsAlong) {
  const std::string source = Written("a.db", {}, {"1"});
  {
    const Result<std::unique_ptr<Store>> store = OpenStore(source);
    ASSERT_TRUE((*store)->Dispose(
        {SampleId("d1"), "unit '1", "2026-11-25T12:00:00Z", "me", "scratched", Verdict::kFail}));
    ASSERT_TRUE((*store)->AddStationCheck({SampleId("c1"),
                                           "S1",
                                           "G",
                                           "2026-11-25T12:00:00Z",
                                           "2026-11-25T11:00:00Z",
                                           true,
                                           0.1,
                                           2.0,
                                           "accelerometer.bias.x",
                                           "golden.csv",
                                           "0a1f",
                                           "gyroscope.bias=1e-4"}));
  }
  // The same by way of JSON lines, of the runs that count alone and of all.
  const auto by_lines = [&](const std::string& name, bool only_standing) {
    const Result<std::unique_ptr<Store>> store = OpenStoreToRead(source);
    const std::string lines = folder_.Path(name + ".jsonl"), target = folder_.Path(name + ".db");
    EXPECT_TRUE(ExportJsonLines(**store, {.only_standing = only_standing}, lines));
    const Result<Collected> collected = Collect({lines}, target);
    EXPECT_TRUE(collected) << collected.error().message;
    return target;
  };
  const Result<Collected> first = Collect({source}, target_);
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_TRUE(Collect({source}, target_));
  for (const std::string& target : {target_, by_lines("all", false), by_lines("standing", true)}) {
    const Result<std::unique_ptr<Store>> store = OpenStoreToRead(target);
    const Result<Decisions> decisions = (*store)->ReadDecisions();
    ASSERT_TRUE(decisions);
    ASSERT_EQ(decisions->dispositions.size(), 1u);
    EXPECT_EQ(decisions->dispositions[0].why, "scratched");
    ASSERT_EQ(decisions->checks.size(), 1u);
    EXPECT_EQ(decisions->checks[0].recording, "0a1f");
    EXPECT_EQ(decisions->checks[0].repeatability, "gyroscope.bias=1e-4");
  }
  const Result<std::unique_ptr<Store>> store = OpenStoreToRead(target_);
  const Result<Table> standing = (*store)->Query("SELECT final_verdict, disposed_by FROM standing");
  EXPECT_THAT(standing->rows, ElementsAre(ElementsAre("FAIL", "me")));
  const Result<std::vector<StationCheck>> checks = (*store)->LastStationChecks("S1");
  ASSERT_TRUE(checks && !checks->empty());
  EXPECT_EQ(checks->front().p, 0.1);
}

// That another recording's serial number was wrong is not said of the one that counts.
TEST_F(Collecting, TakesWrongSerialNumbersOfTheRunsThatCountAlong) {
  const std::string source = Written("a.db", {}, {"1"}), lines = folder_.Path("a.jsonl");
  const Result<std::unique_ptr<Store>> store = OpenStore(source);
  Disposition decision{
      SampleId("d1"), "unit '1", "2026-11-25T12:00:00Z", "me", "exchanged", Verdict::kFail};
  decision.wrong_serial = true;
  ASSERT_TRUE((*store)->Dispose(decision));
  const auto collected = [&](const std::string& target) {
    EXPECT_TRUE(ExportJsonLines(**store, {.only_standing = true}, lines));
    const Result<Collected> done = Collect({lines}, folder_.Path(target));
    EXPECT_TRUE(done) << done.error().message;
    return (*OpenStoreToRead(folder_.Path(target)))
        ->Query("SELECT final_verdict, disposed_why, (SELECT count(*) FROM given_up) FROM standing")
        ->rows;
  };
  EXPECT_THAT(collected("one.db"),
              ElementsAre(ElementsAre("FAIL", "wrong serial number: exchanged", "1")));
  UnitRun second = SampleRun("2", "unit '1");
  second.log = "second.csv", second.readings[0].digest = "0b2f";
  ASSERT_TRUE((*store)->Add(second));
  decision.id = SampleId("d2"), decision.why = "spare", decision.verdict = Verdict::kPass;
  decision.wrong_serial.reset();
  ASSERT_TRUE((*store)->Dispose(decision));
  EXPECT_THAT(collected("two.db"), ElementsAre(ElementsAre("PASS", "spare", "0")));
}

TEST_F(Collecting, TakesTheRetestPolicyAlongAndNoOther) {
  const std::string first = Written("a.db", {}, {"1"}), other = Written("b.db", {}, {"2"}),
                    unstated = Written("c.jsonl", {}, {"3"});
  ASSERT_TRUE((*OpenStore(first))->StateRetestPolicy({RetestCounts::kFirst, std::nullopt}));
  ASSERT_TRUE((*OpenStore(other))->StateRetestPolicy({RetestCounts::kBest, 1}));
  for (const std::string& second : {other, unstated}) {
    const Result<Collected> both = Collect({first, second}, target_);
    ASSERT_FALSE(both);
    EXPECT_EQ(both.error().code, ErrorCode::kConflictingArguments);
    EXPECT_THAT(both.error().message, HasSubstr("but that of " + first + " is `first`"));
    EXPECT_FALSE(std::filesystem::exists(target_));
  }
  ASSERT_TRUE(Collect({first}, target_));
  EXPECT_EQ((*OpenStoreToRead(target_))->Header()->policy->counts, RetestCounts::kFirst);
  const Result<Collected> late = Collect({unstated}, target_);
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("all.db: its retest policy is `first`"));
  EXPECT_EQ(Lines(target_).size(), 1u);
}

TEST_F(Collecting, AddsNothingOfARunThatIsThereWithAnotherContent) {
  const std::string one = Written("1.jsonl", {}, {"1", "2"});
  std::string text = TemporaryFolder::Read(one);
  text.replace(text.rfind("unit '2"), 7, "unit '3");
  const std::string other = folder_.Write("2.jsonl", text);
  const Result<Collected> both = Collect({one, other}, target_);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message,
              HasSubstr("2.jsonl: run " + SampleId("2") + " exists twice with different content"));
  ASSERT_TRUE(Collect({one}, target_));
  EXPECT_THAT(Collect({other}, target_).error().message, HasSubstr("with different content"));
  EXPECT_EQ(Lines(target_).size(), 2u);
}

TEST_F(Collecting, AddsNothingOfADecisionOrCheckThatIsThereWithAnotherContent) {
  const std::string lines = TemporaryFolder::Read(Written("1.jsonl", {}, {"1"}));
  const auto with = [&](const std::string& name, const std::string& why, bool agrees) {
    return folder_.Write(name,
                         lines +
                             LineOf(Disposition{SampleId("d"),
                                                "unit '1",
                                                "2026-11-25T12:00:00Z",
                                                "me",
                                                why,
                                                Verdict::kFail,
                                                SampleId("1")}) +
                             LineOf(StationCheck{.id = SampleId("c"),
                                                 .station = "S1",
                                                 .serial = "G",
                                                 .created = "2026-11-25T12:00:00Z",
                                                 .recorded = "2026-11-25T11:00:00Z",
                                                 .agrees = agrees,
                                                 .parameter = "",
                                                 .log = ""}) +
                             EndLine({1, 1, 1}));
  };
  const std::string one = with("a.jsonl", "bent", true),
                    decided = with("b.jsonl", "scratched", true),
                    checked = with("c.jsonl", "bent", false);
  const std::string decision = "decision " + SampleId("d"),
                    check = "station check " + SampleId("c");
  for (const auto& [other, what] : {std::pair(decided, decision), {checked, check}}) {
    for (const auto& sources : {std::vector{one, other}, std::vector{other, one}}) {
      const Result<Collected> both = Collect(sources, target_);
      ASSERT_FALSE(both);
      EXPECT_EQ(both.error().code, ErrorCode::kDoesNotMatch);
      EXPECT_THAT(both.error().message,
                  HasSubstr(sources[1] + ": " + what + " exists twice with different content"));
      EXPECT_FALSE(std::filesystem::exists(target_));
    }
  }
  ASSERT_TRUE(Collect({one, one}, target_));
  for (const auto& [other, what] : {std::pair(decided, decision), {checked, check}}) {
    const Result<Collected> late = Collect({other}, target_);
    ASSERT_FALSE(late);
    EXPECT_EQ(late.error().code, ErrorCode::kDoesNotMatch);
    EXPECT_THAT(late.error().message, HasSubstr(what + " exists twice with different content"));
  }
}

TEST_F(Collecting, OfAnExportGivesTheStoreAgain) {
  ASSERT_TRUE(
      Collect({Written("0.jsonl", {0, 2}, {"1"}), Written("1.jsonl", {1, 2}, {"2"})}, target_));
  const Result<std::unique_ptr<Store>> store = OpenStoreToRead(target_);
  const std::string exported = folder_.Path("exported.jsonl");
  const Result<std::size_t> runs = ExportJsonLines(**store, {}, exported);
  ASSERT_TRUE(runs) << runs.error().message;
  EXPECT_EQ(*runs, 2u);
  ASSERT_TRUE(Collect({exported}, folder_.Path("again.db")));
  EXPECT_EQ(Lines(folder_.Path("again.db")), Lines(target_));
}

}  // namespace collect_test
}  // namespace truetriad::fleet
