// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/json_lines.h"
#include "fleet/run_samples.h"
#include "fleet/store_samples.h"
#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace json_lines_store_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JsonLines : public ::testing::Test {
 protected:
  std::unique_ptr<Store> Opened() {
    Result<std::unique_ptr<Store>> store = OpenStore(path_);
    EXPECT_TRUE(store) << store.error().message;
    return store ? std::move(*store) : nullptr;
  }
  void Write(const std::vector<std::string>& ids, const Shard& shard = {}) {
    const std::unique_ptr<Store> store = Opened();
    ASSERT_TRUE(store->StateShard(shard));
    for (const std::string& id : ids) {
      UnitRun run = SampleRun(id, "unit " + id);
      run.shard = ShardText(shard);
      ASSERT_TRUE(store->Add(run));
    }
  }
  /// The names of the runs that are read; or why they are not.
  std::vector<std::string> Read() {
    std::vector<std::string> ids;
    const auto take = [&](const UnitRun& run) -> Status {
      ids.push_back(run.id);
      return {};
    };
    const Result<LinesRead> read = ForEachLine(path_, take);
    if (!read) ids = {read.error().message};
    return ids;
  }
  std::string Text() const { return TemporaryFolder::Read(path_); }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.Path("new/shard.jsonl");
};

TEST_F(JsonLines, KeepALineARunToTheLastBit) {
  Write({"1", "2"}, {2, 8});
  EXPECT_THAT(
      Text(),
      ::testing::StartsWith("{\"format\":\"truetriad/"
                            "runs\",\"schema_version\":6,\"shards\":8,\"shard\":2,\"store\":\"2"));
  UnitRun expected = SampleRun("2", "unit 2");
  expected.shard = "2/8";
  std::string found;
  ASSERT_TRUE(ForEachLine(path_, [&](const UnitRun& run) -> Status {
    found = LineOf(run);
    return {};
  }));
  EXPECT_EQ(found, LineOf(expected));
}

TEST_F(JsonLines, PassOverWhatAKilledWriterLeftAndTheNextOneTakesItAway) {
  Write({"1", "2"});
  const std::string whole = Text();
  // Wherever it was cut: in the header, in a line, at a line's end.
  for (std::size_t size = 0; size <= whole.size(); size += size < 100 ? 3 : 1501) {
    folder_.Write("new/shard.jsonl", whole.substr(0, size));
    for (const std::string& id : Read())
      ASSERT_THAT(id, ::testing::AnyOf(SampleId("1"), SampleId("2"))) << size;
    Write({"3"});
    const std::string kept = whole.substr(0, whole.rfind('\n', size == 0 ? 0 : size - 1) + 1);
    ASSERT_TRUE(Text().starts_with(kept)) << size;
    ASSERT_EQ(Read().back(), SampleId("3")) << size;
  }
}

TEST_F(JsonLines, SayWhichLineIsSpoilt) {
  Write({"1", "2"});
  const std::string whole = Text();
  folder_.Write("new/shard.jsonl", whole + "{\"run\": 3}\n");
  EXPECT_THAT(Read(),
              ElementsAre(HasSubstr("shard.jsonl:4: is not a valid record of a fleet run")));
  EXPECT_FALSE(OpenStore(path_));
}

TEST_F(JsonLines, AreOfOneShard) {
  Write({"1"}, {1, 3});
  const std::unique_ptr<Store> store = Opened();
  EXPECT_TRUE(store->StateShard({1, 3}));
  EXPECT_THAT(store->StateShard({1, 4}).error().message, HasSubstr("its shard count is 3, not 4"));
  EXPECT_THAT(store->StateShard({2, 3}).error().message, HasSubstr("shard 1 of 3, not of 2/3"));
  // A line that was put in from elsewhere.
  UnitRun other = SampleRun("2", "B");
  for (const char* const shard : {"2/3", "3/3", "1/4", "", "x"}) {
    other.shard = shard;
    const std::string path = folder_.Write("other.jsonl", Text() + LineOf(other));
    const Result<LinesRead> read = ForEachLine(path, [](const UnitRun&) { return Status(); });
    ASSERT_FALSE(read) << shard;
    EXPECT_THAT(read.error().message, HasSubstr("other.jsonl:3: is a run of shard"));
  }
}

TEST_F(JsonLines, EndWithAMarkHoweverOftenTheyAreGoneOnWith) {
  const auto is_ended = [&] {
    return ForEachLine(path_, [](const UnitRun&) { return Status(); })->is_ended;
  };
  Write({"1"});
  EXPECT_FALSE(is_ended());
  ASSERT_TRUE(Opened()->MarkEnd());
  ASSERT_TRUE(Opened()->MarkEnd());
  EXPECT_TRUE(is_ended());
  const std::string mark = "{\"end\":{\"runs\":1,\"dispositions\":0,\"station_checks\":0}}\n";
  EXPECT_TRUE(Text().ends_with("}\n" + mark));
  Write({"2"});
  EXPECT_FALSE(is_ended());
  ASSERT_TRUE(Opened()->MarkEnd());
  EXPECT_TRUE(is_ended());
  EXPECT_THAT(Read(), ElementsAre(SampleId("1"), SampleId("2")));
  folder_.Write("new/shard.jsonl", Text() + "{");
  EXPECT_FALSE(is_ended());
  // Without a run, too: a shard may have no unit.
  folder_.Write("new/shard.jsonl", "");
  EXPECT_FALSE(is_ended());
  Write({});
  ASSERT_TRUE(Opened()->MarkEnd());
  EXPECT_TRUE(is_ended());
}

TEST_F(JsonLines, HaveOneWriter) {
  const std::unique_ptr<Store> store = Opened();
  const auto second = OpenStore(path_);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another process is writing to this file"));
  // Who reads does not mind.
  EXPECT_THAT(Read(), IsEmpty());
}

TEST_F(JsonLines, KnowTheLastRunOfEachLog) {
  Write({"1", "3"});
  const std::unique_ptr<Store> store = Opened();
  UnitRun again = SampleRun("2", "unit 1");
  again.config_sha256 = "def";
  ASSERT_TRUE(store->Add(again));
  const std::vector<UnitRun> runs = LastRuns(*store);
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs.at(0).config_sha256, "def");
  EXPECT_EQ(runs.at(1).config_sha256, "abc");
}

TEST_F(JsonLines, AreNotTakenForWhatTheyAreNot) {
  const std::string header = "{\"format\":\"truetriad/runs\",\"schema_version\":";
  struct Case {
    std::string text, message;
  };
  for (const Case& one :
       {Case{header + "99,\"shards\":1}\n",
             "has the schema of version 99, but this program reads and writes "
             "version 6; use the truetriad that wrote it"},
        Case{"{\"format\":\"truetriad/runs\"}\n", "states no version"},
        Case{"{\"format\":\"truetriad/runs/3\"}\n", "is not a file of runs"},
        Case{"a log\n1,2\n", "is not a file of runs"},
        Case{"one line without an end", "is not a file of runs"},
        Case{"{}\n", "is not a file of runs"},
        Case{header + "6}\n", "is not a file of runs"},
        Case{header + "6,\"shards\":0}\n", "is not a file of runs"},
        Case{header + "6,\"shards\":2,\"shard\":2}\n", "is not a file of runs"}}) {
    const std::string path = folder_.Write("other.jsonl", one.text);
    const auto store = OpenStore(path);
    ASSERT_FALSE(store) << one.text;
    const auto read = ForEachLine(path, [](const UnitRun&) { return Status(); });
    ASSERT_FALSE(read) << one.text;
    for (const std::string& message : {store.error().message, read.error().message}) {
      EXPECT_THAT(message, AllOf(HasSubstr(path), HasSubstr(one.message)));
    }
    EXPECT_EQ(TemporaryFolder::Read(path), one.text);
  }
  EXPECT_FALSE(OpenStoreToRead(folder_.Path("missing.jsonl")));
  EXPECT_FALSE(OpenStore(folder_.Path("")));
}

TEST_F(JsonLines, SayWhatNoRunCanBe) {
  Write({});
  const std::string header = Text();
  struct Case {
    void (*spoil)(UnitRun* run);
    std::string message;
  };
  const std::vector<Case> cases = {
      {[](UnitRun* run) { run->id = "zzz"; }, "its name is \"zzz\", expected a time"},
      {[](UnitRun* run) { run->id = ""; }, "its name is \"\", expected a time"},
      {[](UnitRun* run) { run->id = "../../x"; }, "expected a time up to 2200"},
      {[](UnitRun* run) { run->serial = ""; }, "has 0 bytes, expected 1 to 1000"},
      {[](UnitRun* run) { run->serial.assign(100'000, 'x'); }, "has 100000 bytes"},
      {[](UnitRun* run) { run->serial = std::string("a\0b", 3); }, "\"a\\u0000b\" has 3 bytes"},
      {[](UnitRun* run) { run->created = "yesterday"; }, "created is \"yesterday\""},
      {[](UnitRun* run) { run->parameters[1].sigma = -1.0; }, "expected 0 or more"},
      {[](UnitRun* run) { run->parameters[1].name = run->parameters[0].name; }, "occurs twice"},
      {[](UnitRun* run) { run->covariance.pop_back(); }, "the covariance has"},
      {[](UnitRun* run) { run->created = "2026-99-25T12:00:00Z"; }, "created is \"2026-99-25"},
      {[](UnitRun* run) { run->created = "2026-11-31T12:00:00Z"; }, "created is \"2026-11-31"},
      {[](UnitRun* run) { run->recorded = "yesterday"; }, "recorded is \"yesterday\""},
      {[](UnitRun* run) { run->recorded_by = "hand"; }, "recorded_by is \"hand\""},
      {[](UnitRun* run) { run->id = "20261125T240000.000000Z-00000001"; }, "expected a time"},
      {[](UnitRun* run) { run->id = "22010101T000000.000000Z-00000001"; }, "up to 2200"},
      {[](UnitRun* run) { run->judgements[0].pass = false; }, "verdict is `PASS`, but its limit"},
      {[](UnitRun* run) { run->verdict = Verdict::kFail; }, "misses none of its limits"},
  };
  for (const Case& one : cases) {
    UnitRun run = SampleRun("1", "A");
    one.spoil(&run);
    folder_.Write("new/shard.jsonl", header + LineOf(run));
    EXPECT_THAT(Read(), ElementsAre(AllOf(HasSubstr("shard.jsonl:2: "), HasSubstr(one.message))));
  }
  const std::string good = LineOf(SampleRun("1", "A"));
  for (const auto& [from, to, message] :
       {std::tuple("\"verdict\":\"PASS\"", "\"verdict\":\"pass\"", "`pass` is not a verdict"),
        {"\"lot\"", "\"lott\"", "unknown tags among"}}) {
    std::string line = good;
    line.replace(line.find(from), std::string_view(from).size(), to);
    folder_.Write("new/shard.jsonl", header + line);
    EXPECT_THAT(Read(), ElementsAre(AllOf(HasSubstr("shard.jsonl:2: "), HasSubstr(message))));
  }
}

TEST_F(JsonLines, KeepTheRetestPolicyThatWasStatedFirst) {
  const RetestPolicy policy{RetestCounts::kBest, 2};
  {
    const std::unique_ptr<Store> store = Opened();
    ASSERT_TRUE(store->StateRetestPolicy(policy));
    ASSERT_TRUE(store->StateShard({}));
  }
  const std::unique_ptr<Store> store = Opened();
  EXPECT_EQ(store->Header()->policy, policy);
  EXPECT_TRUE(store->StateRetestPolicy(policy));
  EXPECT_THAT(store->StateRetestPolicy({}).error().message,
              HasSubstr("`best, 2 more`, not `last`"));
}

TEST_F(JsonLines, TakeNoRetestPolicyOnceTheyHaveBegunWithoutOne) {
  Write({"1"});
  const std::unique_ptr<Store> store = Opened();
  EXPECT_TRUE(store->StateRetestPolicy({}));
  EXPECT_THAT(store->StateRetestPolicy({RetestCounts::kBest, 2}).error().message,
              HasSubstr("was begun without a retest policy"));
}

TEST_F(JsonLines, AnswerNoQuestions) {
  Write({"1"});
  const std::unique_ptr<Store> store = Opened();
  const Result<Table> answer = store->Query("SELECT 1");
  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().message, HasSubstr("truetriad fleet collect " + path_));
  EXPECT_FALSE(store->ForEachRun({}, [](const UnitRun&) { return Status(); }));
  EXPECT_FALSE(store->LastStationChecks("S1"));
  EXPECT_FALSE(store->AddStationCheck({}));
  EXPECT_FALSE(store->AddDecisions({}));
  EXPECT_FALSE(store->ReadDecisions());
  EXPECT_THAT(OpenStoreToRead(path_).error().message, HasSubstr("truetriad fleet collect"));
}

TEST(StoreUrl, OfRunsAsTextHasASchemeOrAnEnding) {
  EXPECT_EQ(JsonLinesPath("a/b.jsonl"), "a/b.jsonl");
  EXPECT_EQ(JsonLinesPath("jsonl:a/b"), "a/b");
  EXPECT_EQ(JsonLinesPath("a/b.db"), std::nullopt);
  EXPECT_EQ(JsonLinesPath("sqlite:a/b.jsonl"), std::nullopt);
}

TEST(AShard, IsBelowItsCount) {
  EXPECT_EQ(ShardFromText("2/8")->index, 2);
  for (const char* const text : {"8/8", "-1/8", "1", "1/", "/8", "1/8x", "0/0", "1/2000000"}) {
    EXPECT_FALSE(ShardFromText(text)) << text;
  }
}

}  // namespace json_lines_store_test
}  // namespace truetriad::fleet
