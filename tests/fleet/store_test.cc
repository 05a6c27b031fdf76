// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "fleet/database.h"
#include "fleet/log_files.h"
#include "fleet/run_samples.h"
#include "fleet/store_samples.h"
#include "io/temporary_folder.h"
#include "support/private_postgres.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {
namespace store_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Of each kind of store the same.
class StoreTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
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
  const std::vector<UnitRun> runs = LastRuns(**store);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs.front().config_sha256, "def");
  EXPECT_EQ(runs.front().serial, "A1");
  EXPECT_EQ(runs.front().tags, second.tags);
  EXPECT_THAT(Ask(**store, "SELECT run FROM latest"), ElementsAre(ElementsAre("2")));
}

// Whose it is may be known by now: the other log was taken away.
TEST_P(StoreTest, HasNotDoneALogThatWasRefusedAsAnotherUnits) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  for (const std::string serial : {"A1", "A2"}) {
    UnitRun run = RunOf(serial);
    run.software_version = Version();
    run.recorded = "2026-11-24T06:00:00Z", run.recorded_by = "file";
    if (serial == "A2") run.code = InfoOf(ErrorCode::kOtherDevice).name;
    ASSERT_TRUE((*store)->Add(run));
  }
  const Result<DoneLogs> done = DoneLogs::In(**store, "abc");
  ASSERT_TRUE(done);
  EXPECT_TRUE(done->Has({.log = "A1.csv"}, {}));
  EXPECT_FALSE(done->Has({.log = "A2.csv"}, {}));
  // Nor one of another lot than that of its run, where a list says so.
  Tags tags;
  for (const std::string lot : {"L17", "L18"}) {
    tags.lot = lot;
    EXPECT_EQ(done->Has({.log = "A1.csv", .tags = tags}, {}), lot == "L17");
  }
  // Nor one whose time a list states that it has not stated before.
  EXPECT_FALSE(done->Has({.log = "A1.csv", .recorded = "2026-11-24T06:00:00Z"}, {}));
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
  EXPECT_THAT(other.error().message, HasSubstr("its shard count is 4, not 5"));
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
  // Twice as many: worked in another order than measured, which is what matters.
  for (std::size_t i = 0; i < 2 * cases.size(); ++i) {
    const bool is_timed = i >= cases.size();
    const Result<std::unique_ptr<Store>> store = OpenStore(i == 0 ? url_ : NewUrl());
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->StateRetestPolicy(cases[i % cases.size()].policy));
    const auto name_of = [&](const std::string& id) {
      return is_timed ? std::to_string(9 - std::stoi(id)) : id;
    };
    // Not in their order.
    const auto add = [&](const std::string& id, Verdict verdict) {
      UnitRun run = RunOf(name_of(id), verdict);
      if (is_timed) run.recorded = "2026-11-0" + id + "T06:00:00Z", run.recorded_by = "list";
      run.log = id + ".csv";
      run.readings = {{"accelerometer", id}};
      ASSERT_TRUE((*store)->Add(run));
    };
    add("5", Verdict::kPass);
    add("1", Verdict::kNoResult);
    add("2", Verdict::kNoResult);
    add("3", Verdict::kFail);
    add("4", Verdict::kPass);
    EXPECT_THAT(Ask(**store, "SELECT run, first_verdict, attempts, disposed_by FROM standing"),
                ElementsAre(ElementsAre(
                    name_of(cases[i % cases.size()].run), "NO_RESULT", "5", std::nullopt)))
        << i;
  }
}

TEST_P(StoreTest, FindsTheRunsOfOtherUnitsWithTheSameReadings) {
  const Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto run = [](const std::string& id, const std::string& serial, Verdict verdict) {
    UnitRun one = RunOf(serial);
    one.id = id;
    one.verdict = verdict;
    one.inputs = {{"a.csv", id, 9}};  // However the files are written.
    one.readings = {{"accelerometer", "aa"}, {"gyroscope", "bb"}};
    return one;
  };
  const auto found = [&](const UnitRun& one) {
    const Result<std::optional<UnitRun>> other = (*store)->RunOfSameReadings(one);
    EXPECT_TRUE(other) << other.error().message;
    return *other ? (*other)->id : "";
  };
  ASSERT_TRUE((*store)->Add(run("1", "A1", Verdict::kNoLimits)));
  ASSERT_TRUE((*store)->Add(run("2", "A2", Verdict::kNoResult)));
  EXPECT_EQ(found(run("3", "A3", Verdict::kPass)), "1");
  EXPECT_EQ(found(run("3", "A1", Verdict::kPass)), "");  // The unit itself.
  UnitRun other = run("3", "A3", Verdict::kPass);
  other.log = "A1.csv";  // Its serial number may have been corrected: people say so.
  EXPECT_EQ(found(other), "1");
  const auto decide =
      [&](const std::string& id, Verdict verdict, std::optional<bool> wrong_serial = {}) {
        Disposition one{id, "A1", "2026-11-25T00:00:00Z", "R. Roe", "why", verdict};
        one.wrong_serial = wrong_serial;
        const Result<Disposition> added = (*store)->Dispose(one);
        return added ? "" : added.error().message;
      };
  EXPECT_EQ(decide("2c", Verdict::kFail), "");  // Bent, say: it was measured all the same.
  EXPECT_EQ(found(other), "1");
  EXPECT_EQ(decide("2d", Verdict::kFail, true), "");
  EXPECT_EQ(found(other), "");
  EXPECT_THAT(Ask(**store, "SELECT disposed_why FROM standing WHERE serial = 'A1'"),
              ElementsAre(ElementsAre("wrong serial number: why")));
  EXPECT_THAT(decide("2e", Verdict::kPass), HasSubstr("state this by --wrong-serial=false"));
  // Bent, too: that does not make it this unit's.
  EXPECT_EQ(decide("2e", Verdict::kFail), "");
  EXPECT_EQ(found(other), "");
  EXPECT_THAT(Ask(**store, "SELECT disposed_why FROM standing WHERE serial = 'A1'"),
              ElementsAre(ElementsAre("why")));
  EXPECT_EQ(decide("2f", Verdict::kPass, false), "");  // The number was right.
  EXPECT_EQ(found(other), "1");
  EXPECT_THAT(Ask(**store, "SELECT final_verdict FROM standing WHERE serial = 'A1'"),
              ElementsAre(ElementsAre("PASS")));
  EXPECT_EQ(decide("2g", Verdict::kFail, true), "");
  ASSERT_TRUE((*store)->Add(run("3", "A1", Verdict::kPass)));  // Calibrated again.
  EXPECT_EQ(found(other), "");
  // Not once another unit has them.
  ASSERT_TRUE((*store)->Add(run("4", "A3", Verdict::kPass)));
  for (const Verdict verdict : kVerdictsOfPeople) {
    EXPECT_THAT(decide("5a", verdict, false), HasSubstr("belong to unit `A3` (run 4"));
  }
  EXPECT_THAT(decide("5a", Verdict::kPass), HasSubstr("belong to unit `A3` (run 4"));
  EXPECT_EQ(decide("5a", Verdict::kFail), "");
  EXPECT_EQ(decide("5b", Verdict::kFail, true), "");
  other = run("3", "A3", Verdict::kPass);
  other.readings[1].digest = "cc";
  EXPECT_EQ(found(other), "");
  other.readings.clear();
  EXPECT_EQ(found(other), "");
}

// Two numbers were exchanged, or one was scanned twice: what was another unit's neither counts nor
// keeps what is the unit's own from counting.
TEST_P(StoreTest, CountsNothingOfWhatWasGivenUp) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto add = [&](const std::string& id,
                       const std::string& serial,
                       const std::string& digest,
                       Verdict verdict = Verdict::kPass) {
    UnitRun run = RunOf(id, verdict);
    run.serial = serial;
    run.log = digest + ".csv";
    run.recorded = "2026-11-28T08:" + digest + ":00Z", run.recorded_by = "list";
    run.readings = {{"accelerometer", digest}};
    ASSERT_TRUE((*store)->Add(run));
  };
  const auto give_up = [&](const std::string& id, const std::string& serial, const auto& run) {
    const Result<Disposition> added = (*store)->Dispose({.id = id,
                                                         .serial = serial,
                                                         .created = "2026-11-28T09:00:00Z",
                                                         .who = "R",
                                                         .why = "exchanged",
                                                         .verdict = Verdict::kFail,
                                                         .run = run,
                                                         .wrong_serial = true});
    return added ? added->run : added.error().message;
  };
  const auto standing = [&] {
    return Ask(**store,
               "SELECT serial, run, final_verdict, first_verdict, attempts FROM standing "
               "ORDER BY serial");
  };
  add("1", "X1", "10", Verdict::kFail);
  add("2", "X2", "00");
  add("3", "X1", "00", Verdict::kNoResult);
  add("4", "X2", "10", Verdict::kNoResult);
  EXPECT_EQ(give_up("4a", "X2", ""), "2");
  EXPECT_EQ(give_up("4b", "X1", ""), "1");
  add("5", "X1", "00");
  add("6", "X2", "10");
  EXPECT_THAT(standing(),
              ElementsAre(ElementsAre("X1", "5", "PASS", "NO_RESULT", "1"),
                          ElementsAre("X2", "6", "PASS", "NO_RESULT", "1")));
  EXPECT_THAT(Ask(**store, "SELECT run FROM given_up ORDER BY run"),
              ElementsAre(ElementsAre("1"), ElementsAre("2")));
  EXPECT_EQ((*store)->GivenUpOf("X1")->at("1").disposed_why, "wrong serial number: exchanged");
  EXPECT_THAT(*(*store)->UnitsHeldBack(), ElementsAre("X1", "X2"));
  // Of several recordings somebody says which.
  add("7", "X3", "20");
  add("8", "X3", "30", Verdict::kFail);
  EXPECT_THAT(give_up("8a", "X3", ""),
              HasSubstr("serial number was wrong: 7 (20.csv), 8 (30.csv)"));
  EXPECT_THAT(give_up("8a", "X3", "5"), HasSubstr("unit `X3` has no run `5`"));
  EXPECT_EQ(give_up("8a", "X3", "8"), "8");
  EXPECT_THAT(standing().back(), ElementsAre("X3", "7", "PASS", "PASS", "1"));
  // Nothing else is left of this one.
  EXPECT_EQ(give_up("8b", "X3", ""), "7");
  EXPECT_THAT(standing().back(), ElementsAre("X3", "8", "FAIL", "PASS", "0"));
  const Result<Disposition> conceded =
      (*store)->Dispose({"8c", "X3", "2026-11-28T09:00:00Z", "R", "spare", Verdict::kPass});
  ASSERT_FALSE(conceded);
  EXPECT_THAT(conceded.error().message, HasSubstr("by run 8, whose serial number was wrong"));
}

// A recording that is calibrated again was not measured again.
TEST_P(StoreTest, TakesARecordingForOneAttempt) {
  for (const auto& [most, run] : {std::pair<int, std::string>{0, "4"}, {1, "5"}, {2, "7"}}) {
    const Result<std::unique_ptr<Store>> store = OpenStore(NewUrl());
    ASSERT_TRUE(store);
    ASSERT_TRUE((*store)->StateRetestPolicy({RetestCounts::kLast, most}));
    const auto add = [&](const std::string& id, const std::string& log, const std::string& digest) {
      UnitRun one = RunOf(id, id == "1" ? Verdict::kNoResult : Verdict::kPass);
      one.log = log;
      one.log_bytes = static_cast<std::int64_t>(log.size());
      if (!digest.empty()) one.readings = {{"accelerometer", digest}};
      ASSERT_TRUE((*store)->Add(one));
    };
    add("1", "a.csv", "");    // Took too long.
    add("2", "a.csv", "aa");  // The same log, untouched.
    add("3", "bb.csv", "bb");
    add("4", "a.csv", "aa");
    add("5", "copy-bb.csv", "bb");
    add("6", "ccc.csv", "cc");
    add("7", "ccc.csv", "cc");
    EXPECT_THAT(Ask(**store, "SELECT run, first_verdict, attempts FROM standing"),
                ElementsAre(ElementsAre(run, "NO_RESULT", "3")));
    EXPECT_THAT(Ask(**store, "SELECT first_run FROM measured ORDER BY run"),
                ElementsAre(ElementsAre("1"),
                            ElementsAre("1"),
                            ElementsAre("3"),
                            ElementsAre("1"),
                            ElementsAre("3"),
                            ElementsAre("6"),
                            ElementsAre("6")));
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
  EXPECT_THAT(other.error().message, HasSubstr("`best, 2 more`, not `last`"));
}

TEST_P(StoreTest, KeepsWhatPeopleDecide) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kFail)));
  Disposition first{"a", "A1", "2026-11-25T00:00:00Z", "R. Roe'; --", "seen", Verdict::kPass};
  const Result<Disposition> added = (*store)->Dispose(first);
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(added->run, "1");
  const std::string standing =
      "SELECT verdict, first_verdict, final_verdict, disposed_by FROM standing";
  EXPECT_THAT(Ask(**store, standing),
              ElementsAre(ElementsAre("FAIL", "FAIL", "PASS", "R. Roe'; --")));
  Disposition second{"b", "A1", "2026-11-26T00:00:00Z", "M. Moe", "bent", Verdict::kFail};
  ASSERT_TRUE((*store)->Dispose(second));
  EXPECT_THAT(Ask(**store, standing), ElementsAre(ElementsAre("FAIL", "FAIL", "FAIL", "M. Moe")));
  EXPECT_THAT(Ask(**store, "SELECT disposition, run, why FROM disposition ORDER BY disposition"),
              ElementsAre(ElementsAre("a", "1", "seen"), ElementsAre("b", "1", "bent")));
}

TEST_P(StoreTest, HoldsADecisionUntilALaterRecordingCounts) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  std::string day = "24", recorded_by = "recording";
  const auto add = [&](const std::string& id, const std::string& log, const std::string& digest) {
    UnitRun run = RunOf(id, Verdict::kPass);
    run.log = log;
    run.log_bytes = static_cast<std::int64_t>(log.size());
    run.recorded = "2026-11-" + day + "T00:00:00Z", run.recorded_by = recorded_by;
    if (!digest.empty()) run.readings = {{"accelerometer", digest}};
    ASSERT_TRUE((*store)->Add(run));
  };
  const auto final_verdict = [&] {
    return *Ask(**store, "SELECT final_verdict FROM standing").at(0).at(0);
  };
  add("1", "a.csv", "aa");
  add("2", "b.csv", "bb");
  ASSERT_TRUE(
      (*store)->Dispose({"2d", "A1", "2026-11-25T00:00:00Z", "R. Roe", "bent", Verdict::kFail}));
  day = "26";
  add("3", "b.csv", "bb");       // Again.
  add("4", "copy-b.csv", "bb");  // Under another name.
  add("5", "b.csv", "");         // Untouched, and not read to its end.
  add("6", "a.csv", "aa");       // Known when it was decided.
  EXPECT_EQ(final_verdict(), "FAIL");
  const auto before = (*store)->StandingOf("A1");
  EXPECT_EQ((*before)->disposed_by + (*before)->disposed_why, "R. Roebent");
  EXPECT_EQ((*before)->disposed_at, "2026-11-25T00:00:00Z");
  day = "25";
  add("61", "earlier.csv", "dd");
  EXPECT_EQ(final_verdict(), "FAIL");
  day = "26", recorded_by = "file";  // Of the last copy.
  add("62", "copied.csv", "ee");
  EXPECT_EQ(final_verdict(), "FAIL");
  recorded_by = "list";
  add("7", "c.csv", "cc");
  EXPECT_EQ(final_verdict(), "PASS");
  EXPECT_EQ((*store)->StandingOf("A1").value()->disposed_by, "");
  // Once lifted, it stays so.
  add("8", "c.csv", "cc");
  EXPECT_EQ(final_verdict(), "PASS");
  ASSERT_TRUE(
      (*store)->Dispose({"8d", "A1", "2026-11-27T00:00:00Z", "R. Roe", "bent", Verdict::kFail}));
  EXPECT_EQ(final_verdict(), "FAIL");
  day = "28";
  add("9", "unreadable.csv", "");
  EXPECT_EQ(final_verdict(), "PASS");
}

// Whoever collects the stores of two stations: a decision was made of what was seen at one of them.
TEST_P(StoreTest, HoldsAConcessionForItsOwnRecordingAlone) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto add = [&](const std::string& id, const std::string& digest) {
    UnitRun run = RunOf(id, Verdict::kFail);
    run.log = id + ".csv";
    run.recorded = "2026-11-25T0" + id + ":00:00Z";
    run.readings = {{"accelerometer", digest}};
    ASSERT_TRUE((*store)->Add(run));
  };
  const auto final_verdict = [&] {
    return *Ask(**store, "SELECT final_verdict FROM standing").at(0).at(0);
  };
  add("1", "aa");
  ASSERT_TRUE((*store)->Dispose(
      {"3d", "A1", "2026-11-25T00:00:00Z", "R. Roe", "tolerable", Verdict::kPass}));
  EXPECT_EQ(final_verdict(), "PASS");
  add("2", "bb");  // Measured, and run, before somebody decided of the other.
  EXPECT_EQ(final_verdict(), "FAIL");
}

TEST_P(StoreTest, HoldsAConcessionForTheLimitsThatWereMissed) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto add = [&](const std::string& id, std::vector<LimitCheck> judgements) {
    UnitRun run = RunOf(id, Verdict::kFail);
    run.readings = {{"accelerometer", "aa"}};
    run.judgements = std::move(judgements);
    ASSERT_TRUE((*store)->Add(run));
  };
  const auto missed = [](const std::string& name, double upper) {
    LimitCheck check;
    check.name = name;
    check.limit.upper = upper;
    check.pass = false;
    return check;
  };
  const auto final_verdict = [&] {
    return *Ask(**store, "SELECT final_verdict FROM standing").at(0).at(0);
  };
  add("1", {missed("accelerometer.bias", 0.2)});
  ASSERT_TRUE((*store)->Dispose(
      {"1d", "A1", "2026-11-25T00:00:00Z", "R. Roe", "tolerable", Verdict::kPass}));
  EXPECT_EQ(final_verdict(), "PASS");
  add("2", {missed("accelerometer.bias", 0.1)});
  EXPECT_EQ(final_verdict(), "FAIL");
  add("3", {missed("accelerometer.bias", 0.2)});
  EXPECT_EQ(final_verdict(), "PASS");
  add("4", {missed("accelerometer.bias", 0.2), missed("accelerometer.scale", 0.1)});
  EXPECT_EQ(final_verdict(), "FAIL");
}

// A copy has another time than its file, and is no later recording; what was calibrated anew of one
// recording takes the place of what was before, whichever recording counts.
TEST_P(StoreTest, CountsTheNewestRunOfARecordingAtTheTimeOfItsListOrFirst) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto add = [&](const std::string& id,
                       Verdict verdict,
                       const std::string& digest,
                       const std::string& recorded,
                       const std::string& recorded_by = "file") {
    UnitRun run = RunOf(id, verdict);
    run.log = id + ".csv";
    run.recorded = recorded;
    run.recorded_by = recorded_by;
    run.readings = {{"accelerometer", digest}};
    ASSERT_TRUE((*store)->Add(run));
  };
  const auto standing = [&] { return *Ask(**store, "SELECT run FROM standing").at(0).at(0); };
  add("1", Verdict::kPass, "aa", "2026-11-25T08:00:00Z");
  add("2", Verdict::kFail, "bb", "2026-11-25T09:00:00Z");
  add("3", Verdict::kPass, "aa", "2026-11-25T10:00:00Z");
  EXPECT_EQ(standing(), "2");
  // The last list that says it knows better.
  add("4", Verdict::kPass, "aa", "2026-11-25T11:00:00Z", "list");
  EXPECT_EQ(standing(), "4");
  EXPECT_THAT(Ask(**store, "SELECT first_verdict FROM standing"), ElementsAre(ElementsAre("FAIL")));
  // The time by which they are ordered is what is shown, whatever the newest run says.
  add("41", Verdict::kPass, "aa", "2026-11-25T12:00:00Z");
  EXPECT_THAT(Ask(**store, "SELECT run, recorded, recorded_by FROM standing"),
              ElementsAre(ElementsAre("41", "2026-11-25T11:00:00Z", "list")));
  add("5", Verdict::kPass, "aa", "2026-11-25T07:00:00Z", "list");
  add("6", Verdict::kPass, "aa", "2026-11-25T12:00:00Z");
  EXPECT_EQ(standing(), "2");
  ASSERT_TRUE((*store)->StateRetestPolicy({RetestCounts::kBest, std::nullopt}));
  EXPECT_EQ(standing(), "6");
  add("7", Verdict::kFail, "aa", "2026-11-25T11:00:00Z");
  EXPECT_EQ(standing(), "2");
  ASSERT_TRUE((*store)->Dispose(
      {"7d", "A1", "2026-11-25T00:00:00Z", "R. Roe", "tolerable", Verdict::kPass}));
  add("8", Verdict::kNoResult, "bb", "2026-11-25T12:00:00Z");
  EXPECT_THAT(Ask(**store, "SELECT run, final_verdict FROM standing"),
              ElementsAre(ElementsAre("7", "FAIL")));
}

// Neither the log that is named nor what is written about it is what was measured.
TEST_P(StoreTest, HoldsADecisionOverReadingsThatWereThere) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->StateRetestPolicy({RetestCounts::kBest, std::nullopt}));
  std::string recorded;
  const auto add =
      [&](const std::string& id, Verdict verdict, std::vector<SensorReadings> readings) {
        UnitRun run = RunOf(id, verdict);
        run.log = id + ".csv";
        run.recorded = recorded;
        run.readings = std::move(readings);
        ASSERT_TRUE((*store)->Add(run));
      };
  const auto final_verdict = [&] {
    return *Ask(**store, "SELECT final_verdict FROM standing").at(0).at(0);
  };
  add("1", Verdict::kFail, {{"accelerometer", "bb"}, {"gyroscope", "b2"}});
  // That it was there, does not count and is later than the first is no matter.
  add("2", Verdict::kNoResult, {{"accelerometer", "dd"}});
  ASSERT_TRUE(
      (*store)->Dispose({"2d", "A1", "2026-11-25T00:00:00Z", "R. Roe", "bent", Verdict::kFail}));
  add("3", Verdict::kFail, {{"accelerometer", "bb"}});  // Without one sensor.
  EXPECT_EQ(final_verdict(), "FAIL");
  add("4", Verdict::kNoLimits, {{"accelerometer", "dd"}});
  EXPECT_EQ(final_verdict(), "FAIL");
  recorded = "2026-11-26T00:00:00Z";
  add("5", Verdict::kPass, {{"accelerometer", "ff"}});
  EXPECT_EQ(final_verdict(), "PASS");
}

TEST_P(StoreTest, NamesADecisionAfterAllRunsOfItsUnit) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->StateRetestPolicy({RetestCounts::kFirst, std::nullopt}));
  ASSERT_TRUE((*store)->Add(RunOf("20261125T120000.000000Z-00000001", Verdict::kPass)));
  UnitRun later = RunOf("20991231T235959.999999Z-ffffffff", Verdict::kPass);
  later.log = "later.csv";
  ASSERT_TRUE((*store)->Add(later));
  const Result<Disposition> added = (*store)->Dispose(
      {NewRunId(), "A1", "2026-11-25T00:00:00Z", "R. Roe", "bent", Verdict::kFail});
  ASSERT_TRUE(added);
  EXPECT_EQ(added->run, "20261125T120000.000000Z-00000001");
  EXPECT_EQ(added->id.substr(0, 23), "21000101T000000.000000Z");
  EXPECT_EQ(*(*store)->LatestRun(RunOf("A1")), added->id);
}

TEST_P(StoreTest, DoesNothingOfWorkThatThrows) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const Status status = (*store)->Together([&]() -> Status {
    EXPECT_TRUE((*store)->Add(RunOf("1", Verdict::kPass)));
    throw std::runtime_error("no memory");
  });
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "no memory");
  ASSERT_TRUE((*store)->Add(RunOf("2", Verdict::kPass)));
  EXPECT_THAT(Ask(**store, "SELECT run FROM run"), ElementsAre(ElementsAre("2")));
}

TEST(RecordingOf, IsOfTheReadingsInAnyOrder) {
  EXPECT_EQ(RecordingOf({{"gyroscope", "cc"}, {"accelerometer", "bb"}}), "bb cc");
}

TEST_P(StoreTest, CountsALaterDecisionThoughTheClockHasGoneBack) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kPass)));
  Disposition of_tomorrow{.id = "29991231T235959.999999Z-ffffffff",
                          .serial = "A1",
                          .created = "2999-12-31T23:59:59Z",
                          .who = "R. Roe",
                          .why = "seen",
                          .verdict = Verdict::kPass};
  Disposition now = of_tomorrow;
  now.id = NewRunId();
  now.verdict = Verdict::kFail;
  ASSERT_TRUE((*store)->Dispose(of_tomorrow));
  const Result<Disposition> added = (*store)->Dispose(now);
  ASSERT_TRUE(added);
  EXPECT_GT(added->id, of_tomorrow.id);
  EXPECT_EQ(added->id.substr(0, 23), "30000101T000000.000000Z");
  EXPECT_THAT(Ask(**store, "SELECT final_verdict FROM standing"), ElementsAre(ElementsAre("FAIL")));
}

TEST_P(StoreTest, KnowsTheLatestRunOfAUnitOrALog) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  EXPECT_EQ(*(*store)->LatestRun(RunOf("A1")), "");
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kPass)));
  UnitRun other = RunOf("B2");
  EXPECT_EQ(*(*store)->LatestRun(other), "");
  other.log = "A1.csv";
  EXPECT_EQ(*(*store)->LatestRun(other), "1");
}

TEST_P(StoreTest, IsNoOther) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_), other = OpenStore(NewUrl());
  ASSERT_TRUE(store && other);
  const std::string identity = (*store)->Header()->store;
  EXPECT_EQ(identity.size(), NewRunId().size());
  EXPECT_EQ(identity, (*OpenStoreToRead(url_))->Header()->store);
  EXPECT_NE(identity, (*other)->Header()->store);
}

TEST_P(StoreTest, TakesNoDecisionThatIsNone) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  ASSERT_TRUE((*store)->Add(RunOf("1", Verdict::kFail)));
  const Disposition good{"a", "A1", "2026-11-25T00:00:00Z", "R. Roe", "seen", Verdict::kPass};
  const auto refused = [&](const auto& spoil, ErrorCode code) {
    Disposition bad = good;
    spoil(&bad);
    const Result<Disposition> run = (*store)->Dispose(bad);
    EXPECT_FALSE(run);
    EXPECT_TRUE(run || run.error().code == code) << run.error().message;
  };
  refused([](Disposition* bad) { bad->serial = "A1' OR '1'='1"; }, ErrorCode::kUnknownName);
  refused([](Disposition* bad) { bad->who = " "; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->why = ""; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->why = "a\nb"; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->why = "a\xFF"; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->verdict = Verdict::kNoResult; }, ErrorCode::kInvalidArgument);
  refused([](Disposition* bad) { bad->wrong_serial = true; }, ErrorCode::kConflictingArguments);
  // Without a calibration, nothing is good.
  UnitRun other = RunOf("B2");
  other.verdict = Verdict::kNoResult;
  ASSERT_TRUE((*store)->Add(other));
  refused([](Disposition* bad) { bad->serial = "B2"; }, ErrorCode::kConflictingArguments);
  EXPECT_THAT(Ask(**store, "SELECT count(*) FROM disposition"), ElementsAre(ElementsAre("0")));
}

TEST_P(StoreTest, KeepsTheChecksOfStations) {
  Result<std::unique_ptr<Store>> store = OpenStore(url_);
  ASSERT_TRUE(store);
  const auto last_of = [&](const std::string& station) {
    const Result<std::vector<StationCheck>> last = (*store)->LastStationChecks(station);
    EXPECT_TRUE(last) << last.error().message;
    return *last;
  };
  EXPECT_TRUE(last_of("S3").empty());
  StationCheck check{"2",
                     "S3",
                     "G1",
                     "2026-11-25T06:00:00Z",
                     "2026-11-25T05:00:00Z",
                     true,
                     0.1 + 0.2,
                     1.0 / 3.0,
                     "a",
                     "l"};
  ASSERT_TRUE((*store)->AddStationCheck(check));
  // The same recording again does not count, whatever is made of it; another one does.
  check.recording = "aa bb";
  check.id = "3";
  check.agrees = false;
  EXPECT_FALSE((*store)->AddStationCheck(check).value());
  check.id = "4";
  check.agrees = true;
  check.repeatability = "accelerometer.bias=1";
  const auto first = (*store)->AddStationCheck(check);
  ASSERT_TRUE(first && *first);
  EXPECT_EQ((*first)->id, "3");
  ASSERT_EQ(last_of("S3").size(), 1U);
  EXPECT_FALSE(last_of("S3")[0].agrees);
  check.id = "5";
  check.recording = "cc";
  EXPECT_FALSE((*store)->AddStationCheck(check).value());
  EXPECT_EQ(last_of("S3")[0].repeatability, "accelerometer.bias=1");
  check.id = "6";
  check.agrees = false;
  check.station = "S4";
  check.p = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE((*store)->AddStationCheck(check));
  ASSERT_EQ(last_of("S3").size(), 1U);
  const StationCheck last = last_of("S3")[0];
  EXPECT_EQ(last.id, "5");
  EXPECT_TRUE(last.agrees);
  EXPECT_EQ(last.p, 0.1 + 0.2);
  EXPECT_EQ(last.largest, 1.0 / 3.0);
  ASSERT_EQ(last_of("S4").size(), 1U);
  EXPECT_FALSE(last_of("S4")[0].agrees);
  EXPECT_TRUE(std::isnan(last_of("S4")[0].p));
  // Each golden unit has its own.
  check.id = "7";
  check.serial = "G2";
  check.recording = "dd";
  EXPECT_FALSE((*store)->AddStationCheck(check).value());
  ASSERT_EQ(last_of("S4").size(), 2U);
  EXPECT_EQ(last_of("S4")[1].serial, "G2");
  // Of one that does not count, what counts is the last of its golden unit. What a recording says
  // of one golden unit takes nothing from what it says of another.
  const auto counting =
      [&](const std::string& id, const std::string& serial, const std::string& recording) {
        check.id = id, check.station = "S3", check.serial = serial, check.recording = recording;
        const auto of = (*store)->AddStationCheck(check);
        EXPECT_TRUE(of && *of);
        return of && *of ? (*of)->id : "";
      };
  EXPECT_EQ(counting("8", "G1", "aa bb"), "5");
  check.id = "9", check.serial = "G3", check.agrees = false;
  EXPECT_FALSE((*store)->AddStationCheck(check).value());
  ASSERT_EQ(last_of("S3").size(), 2U);
  EXPECT_FALSE(last_of("S3")[1].agrees);
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

TEST(AStore, IsAFile) {
  const TemporaryFolder folder;
  const std::string pipe = folder.Path("pipe.jsonl");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& url : {pipe, "sqlite:" + pipe, std::string("/dev/null")}) {
    for (const auto& open : {OpenStore, OpenStoreToRead}) {
      const auto store = open(url);
      ASSERT_FALSE(store) << url;
      EXPECT_THAT(store.error().message, HasSubstr("is not a file"));
    }
  }
  for (const std::string url : {"",
                                ":memory:",
                                "sqlite:",
                                "sqlite::memory:",
                                "file:x?mode=memory",
                                "jsonl:",
                                "host=db password=hunter2",
                                "jsonl:postgresql://u:hunter2@db",
                                "sqlite:postgresql://u:hunter2@db/x",
                                "mysql://u:hunter2@db"}) {
    const auto store = OpenStore(url);
    ASSERT_FALSE(store) << url;
    EXPECT_EQ(store.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(store.error().message + ShownStore(url), ::testing::Not(HasSubstr("hunter2")));
  }
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

}  // namespace store_test
}  // namespace truetriad::fleet
