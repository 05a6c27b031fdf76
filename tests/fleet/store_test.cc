// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/rows.h"
#include "fleet/run_samples.h"
#include "fleet/store_samples.h"
#include "io/temporary_folder.h"
#include "support/private_postgres.h"

namespace truetriad::fleet {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Of each kind of store the same.
class StoreTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
#ifndef TRUETRIAD_HAVE_POSTGRESQL
    if (GetParam() == "PostgreSQL") GTEST_SKIP() << "built without libpqxx";
#endif
    if (GetParam() == "PostgreSQL") TRUETRIAD_SKIP_WITHOUT_POSTGRES();
    url_ = NewUrl();
  }
  std::string NewUrl() {
    if (GetParam() == "PostgreSQL") return PrivatePostgres::Get()->NewDatabase();
    return folder_.Path("fleet" + std::to_string(++stores_) + ".db");
  }

  const TemporaryFolder folder_;
  int stores_ = 0;
  std::string url_;
};
INSTANTIATE_TEST_SUITE_P(Each,
                         StoreTest,
                         ::testing::Values("SQLite", "PostgreSQL"),
                         [](const auto& test) { return test.param; });

TEST_P(StoreTest, KeepsARunOnceWithAllThatBelongsToIt) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store) << store.error().message;
  const UnitRun run = RunOf("a'; DROP TABLE run; --\n\"");
  ASSERT_TRUE((*store)->Add(run));
  ASSERT_TRUE((*store)->Add(run));
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM run"), ElementsAre(ElementsAre("1")));
  EXPECT_THAT(Ask(**store, "SELECT serial FROM unit"), ElementsAre(ElementsAre(run.serial)));
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM parameter"),
              ElementsAre(ElementsAre(std::to_string(run.parameters.size()))));
  EXPECT_THAT(Ask(**store, "SELECT name, value FROM tag"), ElementsAre(ElementsAre("lot", "L17")));
  // To the last bit.
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    const auto rows =
        Ask(**store, "SELECT value, sigma FROM parameter WHERE place = " + std::to_string(i + 1));
    EXPECT_EQ(std::stod(*rows[0][0]), run.parameters[i].value);
    EXPECT_EQ(std::stod(*rows[0][1]), run.parameters[i].sigma);
  }
  EXPECT_THAT(
      Ask(**store, "SELECT covariance FROM run"),
      ElementsAre(ElementsAre(HexOf({reinterpret_cast<const unsigned char*>(run.covariance.data()),
                                     sizeof(double) * run.covariance.size()}))));
}

TEST_P(StoreTest, SaysWhichRunOfALogWasTheLast) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  UnitRun first = RunOf("A1"), second = RunOf("A1");
  first.id = "1";
  second.id = "2";
  second.config_sha256 = "def";
  ASSERT_TRUE((*store)->Add(second));
  ASSERT_TRUE((*store)->Add(first));
  const Result<std::vector<KnownRun>> runs = (*store)->LastRuns();
  ASSERT_TRUE(runs);
  ASSERT_EQ(runs->size(), 1u);
  EXPECT_EQ(runs->front().config_sha256, "def");
  EXPECT_EQ(runs->front().serial, "A1");
  EXPECT_EQ(runs->front().tags, second.tags);
  EXPECT_THAT(Ask(**store, "SELECT run FROM latest"), ElementsAre(ElementsAre("2")));
}

TEST_P(StoreTest, AnswersQuestionsAndNothingElse) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  for (const std::string sql : {"DROP TABLE run",
                                "DELETE FROM run",
                                "SELECT 1; SELECT 2",
                                "SELEC 1",
                                "",
                                "CREATE TABLE x (y)"}) {
    EXPECT_FALSE((*store)->Query(sql)) << sql;
  }
  EXPECT_TRUE((*store)->Query(" SELECT 1 ; "));
}

TEST_P(StoreTest, HasTheSameNumberOfShardsEveryTime) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  EXPECT_TRUE((*store)->StateShard({0, 4}));
  EXPECT_TRUE((*store)->StateShard({0, 4}));
  const Status other = (*store)->StateShard({0, 5});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("shared among 4, not 5"));
}

TEST_P(StoreTest, KeepsFindingsWithWhatTheySayInNumbers) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  UnitRun run = RunOf("A1");
  run.findings = {Finding(FindingCode::kClockOffset, "late", "state it")
                      .About(Triad::kMagnetometer, 1)
                      .AtPose(3)
                      .With("offset", 1.0 / 7.0, 0.01, "s"),
                  Finding(FindingCode::kMessage, "plain")};
  ASSERT_TRUE((*store)->Add(run));
  EXPECT_THAT(
      Ask(**store,
          "SELECT place, sensor, axis, pose, remedy, \"values\" FROM finding ORDER BY place"),
      ElementsAre(
          ElementsAre("1",
                      "magnetometer",
                      "y",
                      "3",
                      "state it",
                      R"({"offset":{"value":0.14285714285714285,"sigma":0.01,"unit":"s"}})"),
          ElementsAre("2", std::nullopt, std::nullopt, std::nullopt, std::nullopt, std::nullopt)));
}

TEST_P(StoreTest, SaysWhichRunOfAUnitCounts) {
  struct Case {
    RetestPolicy policy;
    std::string run;
  };
  const std::vector<Case> cases = {{{RetestCounts::kLast, std::nullopt}, "5"},
                                   {{RetestCounts::kLast, 2}, "3"},
                                   {{RetestCounts::kLast, 0}, "1"},
                                   {{RetestCounts::kFirst, std::nullopt}, "1"},
                                   {{RetestCounts::kBest, std::nullopt}, "5"},
                                   {{RetestCounts::kBest, 3}, "4"},
                                   {{RetestCounts::kBest, 2}, "3"},
                                   {{RetestCounts::kBest, 1}, "2"}};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Result<std::unique_ptr<Store>> store = OpenStore(i == 0 ? url_ : NewUrl());
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->StateRetestPolicy(cases[i].policy));
    // Not in their order.
    ASSERT_TRUE((*store)->Add(RunOf("5", Verdict::kPass)));
    ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kCrashed)));
    ASSERT_TRUE((*store)->Add(RunOf("2", Verdict::kRefused)));
    ASSERT_TRUE((*store)->Add(RunOf("3", Verdict::kOutside)));
    ASSERT_TRUE((*store)->Add(RunOf("4", Verdict::kPass)));
    EXPECT_THAT(Ask(**store, "SELECT run, first_verdict, attempts, disposed_by FROM standing"),
                ElementsAre(ElementsAre(cases[i].run, "crashed", "5", std::nullopt)))
        << i;
  }
}

TEST_P(StoreTest, HasTheSameRetestPolicyEveryTime) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  EXPECT_FALSE((*store)->StateRetestPolicy({RetestCounts::kBest, -1}));
  EXPECT_TRUE((*store)->StateRetestPolicy({RetestCounts::kBest, 2}));
  EXPECT_TRUE((*store)->StateRetestPolicy({RetestCounts::kBest, 2}));
  EXPECT_FALSE((*store)->StateRetestPolicy({RetestCounts::kBest, 3}));
  const Status other = (*store)->StateRetestPolicy({});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kConflictingArguments);
  EXPECT_THAT(other.error().message, HasSubstr("`best, 2 more`, not by `last`"));
}

TEST_P(StoreTest, KeepsWhatPeopleDecide) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kOutside)));
  Disposition first{"a", "A1", "2026-11-25T00:00:00Z", "R. Roe'; --", "seen", Verdict::kPass};
  const Result<std::string> run = (*store)->Dispose(first);
  ASSERT_TRUE(run) << run.error().message;
  EXPECT_EQ(*run, "1");
  const std::string standing =
      "SELECT verdict, first_verdict, final_verdict, disposed_by FROM standing";
  EXPECT_THAT(Ask(**store, standing),
              ElementsAre(ElementsAre("outside-limits", "outside-limits", "pass", "R. Roe'; --")));
  Disposition second{"b", "A1", "2026-11-26T00:00:00Z", "M. Moe", "bent", Verdict::kRefused};
  ASSERT_TRUE((*store)->Dispose(second));
  EXPECT_THAT(Ask(**store, standing),
              ElementsAre(ElementsAre("outside-limits", "outside-limits", "refused", "M. Moe")));
  EXPECT_THAT(Ask(**store, "SELECT disposition, run, why FROM disposition ORDER BY disposition"),
              ElementsAre(ElementsAre("a", "1", "seen"), ElementsAre("b", "1", "bent")));
  // Of that run, and not of a later one.
  ASSERT_TRUE((*store)->Add(RunOf("2", Verdict::kPass)));
  EXPECT_THAT(Ask(**store, standing),
              ElementsAre(ElementsAre("pass", "outside-limits", "pass", std::nullopt)));
}

TEST_P(StoreTest, TakesNoDecisionThatIsNone) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kOutside)));
  const Disposition good{"a", "A1", "2026-11-25T00:00:00Z", "R. Roe", "seen", Verdict::kPass};
  const auto refused = [&](const auto& spoil, ErrorCode code) {
    Disposition bad = good;
    spoil(&bad);
    const Result<std::string> run = (*store)->Dispose(bad);
    EXPECT_FALSE(run);
    EXPECT_TRUE(run || run.error().code == code) << run.error().message;
  };
  refused([](Disposition* bad) { bad->serial = "A1' OR '1'='1"; }, ErrorCode::kUnknownName);
  refused([](Disposition* bad) { bad->who = " "; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->why = ""; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->why = "a\nb"; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->verdict = Verdict::kCrashed; }, ErrorCode::kInvalidArgument);
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM disposition"), ElementsAre(ElementsAre("0")));
}

TEST_P(StoreTest, KeepsTheChecksOfStations) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto none = (*store)->LastStationCheck("S3");
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  StationCheck check{"2", "S3", "G1", "2026-11-25T06:00:00Z", true, 0.1 + 0.2, 1.0 / 3.0, "a", "l"};
  ASSERT_TRUE((*store)->AddStationCheck(check));
  check.id = "1";
  check.agrees = false;
  ASSERT_TRUE((*store)->AddStationCheck(check));
  check.id = "3";
  check.station = "S4";
  check.p = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE((*store)->AddStationCheck(check));
  const auto last = (*store)->LastStationCheck("S3");
  ASSERT_TRUE(last && *last);
  EXPECT_EQ((*last)->id, "2");
  EXPECT_TRUE((*last)->agrees);
  EXPECT_EQ((*last)->p, 0.1 + 0.2);
  EXPECT_EQ((*last)->largest, 1.0 / 3.0);
  const auto other = (*store)->LastStationCheck("S4");
  ASSERT_TRUE(other && *other);
  EXPECT_FALSE((*other)->agrees);
  EXPECT_TRUE(std::isnan((*other)->p));
}

TEST_P(StoreTest, GivesWholeRunsBack) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store) << store.error().message;
  std::vector<std::string> expected, found;
  std::vector<UnitRun> runs;
  for (int i = 0; i < 120; ++i) {
    runs.push_back(SampleRun("r" + std::to_string(i), "unit '" + std::to_string(i % 110)));
    expected.push_back(LineOf(runs.back()));
  }
  ASSERT_TRUE((*store)->AddAll(runs));
  ASSERT_TRUE((*store)->ForEachRun({}, [&](const UnitRun& run) -> Status {
    found.push_back(LineOf(run));
    return {};
  }));
  EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(expected));
  found.clear();
  ASSERT_TRUE(
      (*store)->ForEachRun({true, "serial < 'unit ''2'"}, [&](const UnitRun& run) -> Status {
        found.push_back(run.id);
        return {};
      }));
  // 0, 1, 10 to 19 and 100 to 109, of which ten have been calibrated again.
  EXPECT_EQ(found.size(), 22u);
}

TEST(NameOfStore, IsTheSameBeforeThereIsOneAndAfter) {
  const TemporaryFolder folder;
  const std::string path =
      std::filesystem::proximate(folder.Path("not/there/yet/../fleet.db")).string();
  const std::string before = NameOfStore(path);
  ASSERT_TRUE(OpenStore(path));
  EXPECT_EQ(NameOfStore(path), before);
  EXPECT_EQ(NameOfStore("sqlite:" + path), before);
  EXPECT_TRUE(std::filesystem::path(before).is_absolute());
}

}  // namespace
}  // namespace truetriad::fleet
