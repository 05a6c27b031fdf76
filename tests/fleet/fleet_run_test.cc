// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <array>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fleet/database.h"
#include "fleet/log_files.h"
#include "fleet/unit_folders.h"
#include "fleet/unit_work.h"
#include "io/temporary_folder.h"
#include "support/log_writer.h"

namespace truetriad::fleet {
namespace fleet_engine_test {

namespace fs = std::filesystem;

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Tags LotAndStation(const std::string& lot, const std::string& station = "") {
  Tags tags;
  tags.lot = lot;
  tags.station = station;
  return tags;
}

/// A database that cannot be written to for a while.
class FailingDatabase : public Database {
 public:
  explicit FailingDatabase(std::unique_ptr<Database> inner) : inner_(std::move(inner)) {}

  const std::string& name() const override { return inner_->name(); }
  std::size_t rows_at_once() const override { return inner_->rows_at_once(); }
  Status Transact(Access access, const std::function<Status()>& work) override {
    if (access == Access::kWrite && failures > 0) {
      --failures;
      return Error(ErrorCode::kStoreFailure, "the store is away");
    }
    if (access == Access::kRead && on_question) on_question();
    return inner_->Transact(access, work);
  }
  Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) override {
    return inner_->Run(sql, values);
  }
  Result<Table> Ask(std::string_view sql, std::span<const Value> values) override {
    return inner_->Ask(sql, values);
  }
  Result<Table> AskAsGiven(const std::string& sql) override { return inner_->AskAsGiven(sql); }

  int failures = 0;
  std::function<void()> on_question;

 private:
  std::unique_ptr<Database> inner_;
};

class Engine : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.worker_command = {TRUETRIAD_BINARY, "fleet-worker"};
    options_.plan.has_report = false;
    options_.plan.folder = folder_.Path("units");
    fs::create_directories(options_.plan.folder);
    for (int i = 0; i < 3; ++i) AddLog(i);
    auto database = OpenSqlite(url_, Access::kWrite);
    ASSERT_TRUE(database) << database.error().message;
    auto failing = std::make_unique<FailingDatabase>(std::move(*database));
    database_ = failing.get();
    auto store = Store::Open(std::move(failing));
    ASSERT_TRUE(store) << store.error().message;
    store_ = std::move(*store);
  }
  void AddLog(int i) {
    LogOptions log{.rests = 12, .magnetometer = false};
    log.seed = static_cast<std::uint64_t>(i + 1);
    units_.push_back({.log = folder_.Write("u" + std::to_string(i) + ".csv", LogText(log))});
  }
  Result<FleetProgress> Run() {
    FleetListener listener;
    listener.on_note = [this](const std::string& note) { notes_.push_back(note); };
    listener.on_warning = [this](const std::string& warning) { warnings_.push_back(warning); };
    return RunFleet(units_, options_, *store_, listener, [] { return false; });
  }
  /// What the store has been given, unit by unit.
  std::vector<UnitRun> Runs() {
    std::vector<UnitRun> runs;
    EXPECT_TRUE(store_->ForEachRun({}, [&](UnitRun run) -> Status {
      runs.push_back(std::move(run));
      return {};
    }));
    return runs;
  }

  const TemporaryFolder folder_;
  FleetOptions options_;
  std::vector<UnitOrder> units_;
  const std::string url_ = folder_.Path("fleet.db");
  std::unique_ptr<Store> store_;
  FailingDatabase* database_ = nullptr;  ///< Of the store.
  std::vector<std::string> notes_, warnings_;
};

TEST_F(Engine, EndsWithTheErrorOfItsStore) {
  database_->failures = 1;
  const Result<FleetProgress> progress = Run();
  ASSERT_FALSE(progress);
  EXPECT_EQ(progress.error().code, ErrorCode::kStoreFailure);
}

TEST_F(Engine, WithPatienceTriesItsStoreAgainAndLosesNothing) {
  options_.is_patient = true;
  database_->failures = 1;
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress) << progress.error().message;
  EXPECT_EQ(progress->done, 3u);
  EXPECT_THAT(Runs(), SizeIs(3));
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("the store is away"), "the store works again"));
}

TEST_F(Engine, HoldsUnitsForAsLongAsItIsTold) {
  int asked = 0;
  options_.hold = [&](const std::string&) -> Result<std::optional<std::string>> {
    return ++asked == 1 ? std::optional<std::string>("overdue") : std::nullopt;
  };
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress);
  EXPECT_EQ(progress->done, 3u);
  EXPECT_THAT(notes_, ElementsAre("calibration waits: overdue", "calibration continues"));
}

// What a worker has lost stays with it alone: another goes on.
TEST_F(Engine, RenewsAWorkerThatHasGrown) {
  for (int i = 3; i < 11; ++i) AddLog(i);
  const std::string worker =
      folder_.Write("worker", "#!/bin/sh\necho >>'" + folder_.Path("starts") + "'\nexec \"$@\"\n");
  fs::permissions(worker, fs::perms::owner_all);
  options_.worker_command.insert(options_.worker_command.begin(), worker);
  ASSERT_EQ(setenv("TRUETRIAD_FLEET_FAULT", "grow:u0", 1), 0);
  const Result<FleetProgress> progress = Run();
  unsetenv("TRUETRIAD_FLEET_FAULT");
  ASSERT_TRUE(progress) << progress.error().message;
  EXPECT_EQ(progress->red, 0u);
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("starts")), "\n\n");
}

TEST_F(Engine, KeepsTheTagsOfALogThatCannotBeRead) {
  units_ = {{.log = folder_.Path("none.csv"), .tags = LotAndStation("L1")}};
  const Result<WorkPlan> plan = PlanWork("", {"run.station=\"S3\"", "run.lot=\"L0\""}, {});
  ASSERT_TRUE(plan) << plan.error().message;
  options_.plan.tags = plan->tags;
  ASSERT_TRUE(Run());
  ASSERT_THAT(Runs(), SizeIs(1));
  EXPECT_EQ(Runs()[0].verdict, Verdict::kNoResult);
  EXPECT_EQ(Runs()[0].tags, LotAndStation("L1", "S3"));
}

TEST_F(Engine, SaysWhichLineDoesNotAgreeWithTheLog) {
  folder_.Write("recording.yaml",
                "recording: 1\nserial: B7\napplied: none\nstreams:\n  accelerometer: { file: "
                "u0.csv, time: { column: \"time[s]\", unit: s }, x: \"accel_x[m/s^2]\", y: "
                "\"accel_y[m/s^2]\", z: \"accel_z[m/s^2]\", unit: m/s^2 }\n");
  units_ = {{.log = folder_.Path("recording.yaml"), .serial = "B8", .serial_from = "day.csv:3"}};
  ASSERT_TRUE(Run());
  ASSERT_THAT(Runs(), SizeIs(1));
  EXPECT_EQ(Runs()[0].code, "other-device");
  EXPECT_EQ(Runs()[0].serial, "B8");
  EXPECT_EQ(Runs()[0].message,
            "day.csv:3: states serial number `B8`, but " + folder_.Path("recording.yaml") +
                " is of unit `B7`; correct the one that is wrong");
}

// Else it would pass under the check of another station's golden unit.
TEST_F(Engine, RefusesARecordingThatStatesAnotherStation) {
  folder_.Write("recording.yaml",
                "recording: 1\nserial: B7\nrun: { station: S2 }\napplied: none\nstreams:\n  "
                "accelerometer: { file: u0.csv, time: { column: \"time[s]\", unit: s }, x: "
                "\"accel_x[m/s^2]\", y: \"accel_y[m/s^2]\", z: \"accel_z[m/s^2]\", unit: m/s^2 "
                "}\n");
  units_ = {{.log = folder_.Path("recording.yaml")}};
  options_.plan.tags = LotAndStation("", "S1");
  options_.plan.overrides = {"run.station=\"S1\""};
  ASSERT_TRUE(Run());
  ASSERT_THAT(Runs(), SizeIs(1));
  EXPECT_EQ(Runs()[0].verdict, Verdict::kNoResult);
  EXPECT_EQ(Runs()[0].message,
            folder_.Path("recording.yaml") +
                ": states station `S2`, but --tag, the list or the experiment states station "
                "`S1` for this unit; correct the wrong one");
  options_.plan.tags.station = "S2";
  options_.plan.overrides = {"run.station=\"S2\""};
  ASSERT_TRUE(Run());
  EXPECT_THAT(Runs()[1].message, Not(HasSubstr("states station")));
}

TEST(DoneLogs, AreThoseWithTheSerialAndTagsThatAreStated) {
  DoneLogs done;
  const LogStamp stamp{7, 8};
  done.Add("a.csv", stamp, "A1", LotAndStation("L1", "S1"));
  EXPECT_TRUE(done.Has({.log = "a.csv"}, stamp));
  EXPECT_TRUE(done.Has({.log = "a.csv", .serial = "A1", .tags = LotAndStation("L1")}, stamp));
  EXPECT_FALSE(done.Has({.log = "a.csv", .serial = "A2"}, stamp));
  EXPECT_FALSE(done.Has({.log = "a.csv", .tags = LotAndStation("L2")}, stamp));
  EXPECT_FALSE(done.Has({.log = "a.csv", .tags = LotAndStation("", "S2")}, stamp));
  EXPECT_FALSE(done.Has({.log = "a.csv"}, {7, 9}));
}

TEST(ConfigSha256, IsOfWhatIsCalculatedAndNotOfTags) {
  const TemporaryFolder folder;
  const std::string text = "experiment: 1\nsensors: { accelerometer: {} }\n";
  const std::string plain = folder.Write("plain.yaml", text);
  const std::string tagged =
      folder.Write("tagged.yaml", text + "run: { lot: L1, note: x }\ndevice: { part: P }\n");
  const auto sha = [](const std::string& config, std::vector<std::string> overrides) {
    const Result<WorkPlan> plan = PlanWork(config, std::move(overrides), {});
    EXPECT_TRUE(plan) << plan.error().message;
    return ConfigSha256(*plan).value();
  };
  EXPECT_EQ(sha(plain, {}), sha(tagged, {"run.lot=\"L2\""}));
  EXPECT_EQ(sha("", {}), sha("", {"run.lot=\"L2\"", "device.part=P"}));
  EXPECT_NE(sha(plain, {}), sha(plain, {"robust.loss=none"}));
  EXPECT_NE(sha("", {}), sha("", {"robust.loss=none"}));
}

// Whichever is done first.
TEST_F(Engine, RefusesAllUnitsOfOneRecording) {
  options_.jobs = 2;
  const std::string text = "# Copied.\n" + TemporaryFolder::Read(units_[0].log);
  units_.push_back({.log = folder_.Write("v0.csv", text)});
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress) << progress.error().message;
  EXPECT_EQ(progress->codes, (std::map<std::string, std::size_t>{{"other-device", 2}}));
  EXPECT_EQ(progress->verdicts.at(Verdict::kNoLimits), 2u);
  const std::vector<UnitRun> runs = Runs();
  ASSERT_THAT(runs, SizeIs(4));
  EXPECT_THAT(runs[0].message, HasSubstr("u0.csv: has the same readings as " + units_[3].log));
  EXPECT_THAT(runs[3].message, HasSubstr("v0.csv: has the same readings as " + units_[0].log));
}

TEST_F(Engine, NamesUnitsThatDifferInCapitalLettersAlone) {
  units_[0].serial = "b7", units_[1].serial = "B7";
  ASSERT_TRUE(Run());
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("`b7`"), HasSubstr("B7"))));
}

TEST_F(Engine, SaysThatTwoRecordingsWereMeasuredAtOnce) {
  for (UnitOrder& unit : units_) unit.serial = "B7", unit.recorded = "2026-11-24T06:00:00Z";
  units_.pop_back();
  options_.jobs = 2;
  ASSERT_TRUE(Run());
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("were both measured at 2026-11-24T06:00:00Z")));
  // In the order of the list, whichever is done first.
  EXPECT_EQ(store_->StandingOf("B7").value()->log, units_[1].log);
}

TEST_F(Engine, SaysInWordsWhatOverrulesARun) {
  ASSERT_TRUE(store_->StateRetestPolicy({RetestCounts::kFirst, std::nullopt}));
  UnitRun first;
  first.id = "20200101T000000.000000Z-00000001";
  first.serial = "u0", first.log = "gone.csv";
  ASSERT_TRUE(store_->Add(first));
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress) << progress.error().message;
  EXPECT_EQ(progress->overruled.at("u0"), "NO RESULT by its current run " + first.id);
}

TEST_F(Engine, CountsUnitsThatAreLeftOutByTheRunThatCounts) {
  ASSERT_TRUE(Run());
  ASSERT_TRUE(store_->Dispose(
      {NewRunId(), "u1", "2026-11-25T00:00:00Z", "R. Roe", "bent", Verdict::kFail}));
  options_.resumes = true;
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress) << progress.error().message;
  EXPECT_EQ(progress->skipped, 3u);
  EXPECT_THAT(progress->skipped_red, ElementsAre("u1"));
  EXPECT_FALSE(progress->IsGood());
}

// Whichever of them is done first.
TEST_F(Engine, CountsEveryRunOfAUnitThatIsNotGood) {
  UnitOrder good = units_[0], bad{.log = folder_.Path("none.csv")};
  good.serial = bad.serial = "B7";
  good.recorded = "2026-11-24T06:00:00Z", bad.recorded = "2026-11-24T07:00:00Z";
  for (const auto& units : {std::vector{good, bad}, std::vector{bad, good}}) {
    units_ = units;
    const Result<FleetProgress> progress = Run();
    ASSERT_TRUE(progress) << progress.error().message;
    EXPECT_EQ(progress->red, 1u);
    EXPECT_EQ(progress->NotGood(), 2u);
    EXPECT_EQ(progress->yield.final_good, 0u);
  }
  // And once the unit is good, only what is not good itself.
  std::swap(good.recorded, bad.recorded);
  units_ = {bad, good};
  EXPECT_EQ(Run()->NotGood(), 1u);
}

TEST_F(Engine, DoesNotBlameAUnitForADiskThatCannotBeWritten) {
  options_.plan.folder = "/proc/none";
  const Result<FleetProgress> progress = Run();
  ASSERT_FALSE(progress);
  EXPECT_EQ(progress.error().code, ErrorCode::kCannotWrite);
  EXPECT_THAT(Runs(), IsEmpty());
}

TEST_F(Engine, GivesALaterNameWhereTheClockHasGoneBack) {
  for (int i = 0; i < 3; ++i) {
    UnitRun earlier;
    earlier.id = "29991231T235959.99999" + std::to_string(i) + "Z-ffffffff";
    earlier.serial = "u" + std::to_string(i);
    ASSERT_TRUE(store_->Add(earlier));
  }
  const Result<FleetProgress> progress = Run();
  ASSERT_TRUE(progress) << progress.error().message;
  const std::vector<UnitRun> runs = Runs();
  ASSERT_THAT(runs, SizeIs(6));
  for (std::size_t i = 1; i < runs.size(); i += 2) {
    EXPECT_EQ(runs[i].serial, runs[i - 1].serial);
    EXPECT_EQ(fs::path(runs[i].folder).filename(), runs[i].id);
    EXPECT_TRUE(fs::exists(runs[i].folder + "/calibration.yaml"));
  }
}

TEST_F(Engine, NamesARunAfterWhatWasDecidedWithoutIt) {
  units_.resize(1);
  UnitRun earlier;
  earlier.id = NewRunId();
  earlier.serial = "u0";
  ASSERT_TRUE(store_->Add(earlier));
  const Disposition decision = {.id = "",
                                .serial = "u0",
                                .created = "2026-11-25T12:00:00Z",
                                .who = "R. Roe",
                                .why = "bent",
                                .verdict = Verdict::kFail};
  std::string decided;
  int questions = 0;
  database_->on_question = [&] {
    if (++questions != 2) return;  // The first is asked before the unit is begun.
    Disposition now = decision;
    now.id = NewRunId();
    decided = (*OpenStore(url_))->Dispose(now)->id;
  };
  ASSERT_TRUE(Run());
  const std::vector<UnitRun> runs = Runs();
  ASSERT_THAT(runs, SizeIs(2));
  EXPECT_GT(runs[1].id, decided);
  EXPECT_EQ(fs::path(runs[1].folder).filename(), runs[1].id);
}

TEST_F(Engine, SaysWhichRunLiftsADecision) {
  units_.resize(1);
  ASSERT_TRUE(Run());
  ASSERT_TRUE(store_->Dispose({.id = NewRunId(),
                               .serial = "u0",
                               .created = "2026-11-25T12:00:00Z",
                               .who = "R. Roe",
                               .why = "bent",
                               .verdict = Verdict::kFail}));
  ASSERT_TRUE(Run());
  EXPECT_THAT(warnings_, IsEmpty());
  fs::create_directories(folder_.Path("again"));
  units_[0] = {.log = folder_.Write("again/u0.csv",
                                    LogText({.rests = 12, .magnetometer = false, .seed = 9}))};
  // Later than the first by its file alone, not in the same second.
  fs::last_write_time(units_[0].log, fs::file_time_type::clock::now() + std::chrono::seconds(2));
  ASSERT_TRUE(Run());
  EXPECT_THAT(warnings_,
              ElementsAre(AllOf(HasSubstr("does not lift the decision of R. Roe (FAIL: bent)"),
                                HasSubstr("its time of measurement is known only from"),
                                HasSubstr("`truetriad fleet dispose u0 --store="))));
  units_[0].recorded = "2999-11-25T12:00:00Z";
  warnings_.clear();
  ASSERT_TRUE(Run());
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr(" lifts the decision of R. Roe (FAIL: bent)")));
}

// A unit that missed its limits is good by others, of a time in between nobody knows any.
TEST_F(Engine, SaysByWhichOtherLimitsAUnitIsGood) {
  units_.resize(1);
  const auto run = [&](std::vector<std::string> limits) {
    options_.plan.overrides = std::move(limits);
    warnings_.clear();
    const Result<FleetProgress> progress = Run();
    ASSERT_TRUE(progress) << progress.error().message;
    ASSERT_EQ(progress->warnings_said.size(), warnings_.size());
    for (std::size_t i = 0; i < warnings_.size(); ++i) {
      EXPECT_EQ(progress->warnings_said[i].text, warnings_[i]);
    }
  };
  const std::string narrow = "limits.accelerometer.bias=0.0001",
                    wide = "limits.accelerometer.bias=5";
  const auto was_fail = ::testing::StartsWith("u0: was FAIL because of accelerometer.bias.");
  run({narrow});
  EXPECT_THAT(warnings_, IsEmpty());
  run({wide});
  EXPECT_THAT(
      warnings_,
      ElementsAre(AllOf(was_fail, HasSubstr("of ± 0.0001 m/s²"), HasSubstr("of ± 5 m/s²"))));
  run({narrow});
  run({"limits.accelerometer.scale_error=0.9"});
  EXPECT_THAT(warnings_, ElementsAre(AllOf(was_fail, HasSubstr("is not judged by this limit"))));
  run({narrow});
  UnitRun cut_off;
  cut_off.id = NewRunId();
  cut_off.serial = "u0", cut_off.log = "cut-off.csv";
  cut_off.recorded = "2999-01-01T00:00:00Z";
  ASSERT_TRUE(store_->Add(cut_off));
  fs::create_directories(folder_.Path("again"));
  units_[0] = {.log = folder_.Write("again/u0.csv",
                                    LogText({.rests = 12, .magnetometer = false, .seed = 9})),
               .recorded = "2999-01-02T00:00:00Z"};
  run({});
  EXPECT_THAT(warnings_, ElementsAre(AllOf(was_fail, HasSubstr("and is NO LIMITS SET now"))));
  run({wide});
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(Engine, SaysAtWhichRateAndForHowLong) {
  FleetProgress progress;
  progress.units = 300;
  progress.done = 60;
  progress.seconds = 20.0;
  EXPECT_DOUBLE_EQ(progress.Rate(), 3.0);
  EXPECT_DOUBLE_EQ(progress.SecondsLeft().value(), 80.0);
  progress.units.reset();
  EXPECT_FALSE(progress.SecondsLeft());
}

// Who sent the orders was killed before the worker had begun.
TEST(Worker, WithNobodyAtTheOtherEndMakesNothing) {
  const TemporaryFolder folder;
  folder.Write("log.csv", LogText({.rests = 16}));
  WorkPlan plan;
  plan.folder = folder.Path("units");
  plan.has_report = false;
  UnitOrder order;
  order.log = folder.Path("log.csv");
  order.serial = "A1";
  const std::string orders = LineOf(plan) + LineOf(order);
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  ASSERT_EQ(write(ends[0], orders.data(), orders.size()), static_cast<ssize_t>(orders.size()));
  close(ends[0]);
  const pid_t child = fork();
  if (child == 0) _exit(ServeAsWorker(ends[1]));
  close(ends[1]);
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_FALSE(fs::exists(plan.folder));
}

// Of a run that was ended before it was in the store.
TEST(UnitFolders, OfHalfARunAreRemovedByTheNextWhoIsAlone) {
  const TemporaryFolder folder;
  const std::string units = folder.Path("units");
  Result<std::unique_ptr<Store>> store = OpenStore(folder.Path("fleet.db"));
  ASSERT_TRUE(store);
  UnitRun kept;
  kept.id = NewRunId();
  kept.serial = "A1";
  kept.folder = units + "/A1/" + kept.id;
  ASSERT_TRUE(BeginFolder(kept.folder, "day"));
  ASSERT_TRUE((*store)->Add(kept));
  const std::string half = units + "/A1/" + NewRunId(), only = units + "/A2/" + NewRunId();
  ASSERT_TRUE(BeginFolder(half, "day"));
  ASSERT_TRUE(BeginFolder(only, "day"));
  fs::create_directories(units + "/A1/of somebody else");
  const std::string of_another = units + "/A3/" + NewRunId();
  ASSERT_TRUE(BeginFolder(of_another, "another day"));
  {
    const Result<FolderClaim> claim = FolderClaim::Share(units, **store, "day");
    ASSERT_TRUE(claim) << claim.error().message;
    EXPECT_TRUE(fs::exists(kept.folder));
    EXPECT_TRUE(fs::exists(units + "/A1/of somebody else"));
    EXPECT_TRUE(fs::exists(of_another));
    EXPECT_FALSE(fs::exists(half));
    EXPECT_FALSE(fs::exists(units + "/A2"));
    // What is in hand is nobody else's to remove.
    ASSERT_TRUE(BeginFolder(half, "day"));
    EXPECT_TRUE(FolderClaim::Share(units, **store, "day"));
    EXPECT_TRUE(fs::exists(half));
  }
  EXPECT_TRUE(FolderClaim::Share(units, **store, "day"));
  EXPECT_FALSE(fs::exists(half));
}

TEST(UnitFolders, HaveOneWhoHasThemAlone) {
  const TemporaryFolder folder;
  {
    const Result<FolderClaim> one = FolderClaim::TakeAlone(folder.Path(""));
    ASSERT_TRUE(one);
    const Result<FolderClaim> other = FolderClaim::TakeAlone(folder.Path(""));
    ASSERT_FALSE(other);
    EXPECT_THAT(other.error().message, HasSubstr("another fleet watch"));
    EXPECT_TRUE(FolderClaim::TakeAlone(folder.Path(""), {1, 4}));
  }
  EXPECT_TRUE(FolderClaim::TakeAlone(folder.Path("")));
}

std::string TimeBefore(double seconds) {
  const std::time_t time = std::time(nullptr) - static_cast<std::time_t>(seconds);
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

StationCheck CheckBefore(double seconds, bool agrees, const std::string& serial = "G1") {
  StationCheck check;
  check.id = NewRunId();
  check.station = "S3";
  check.serial = serial;
  check.created = TimeBefore(0.0);
  check.recorded = TimeBefore(seconds);
  check.agrees = agrees;
  return check;
}

TEST(GoldenHold, IsForAStationThatWasNotCheckedInTimeOrDidNotAgree) {
  const TemporaryFolder folder;
  const Result<std::unique_ptr<Store>> store = OpenStore(folder.Path("fleet.db"));
  ASSERT_TRUE(store);
  const auto why = [&] {
    const Result<std::optional<std::string>> hold = GoldenHold(**store, "S3", 3600.0);
    EXPECT_TRUE(hold);
    return hold->value_or("");
  };
  const auto check = [&](double seconds, bool agrees, const std::string& serial = "G1") {
    ASSERT_TRUE((*store)->AddStationCheck(CheckBefore(seconds, agrees, serial)));
  };
  StationCheck other = CheckBefore(10.0, true);
  other.station = "S4";
  ASSERT_TRUE((*store)->AddStationCheck(other));
  EXPECT_THAT(why(), HasSubstr("no check of its golden unit"));
  check(3700.0, true);
  EXPECT_THAT(why(), HasSubstr("is 1.028 h old, but may be at most 1 h old"));
  check(20.0, true);
  EXPECT_EQ(why(), "");
  // However long ago, and whatever other golden units say.
  check(3650.0, false, "G0");
  EXPECT_THAT(why(),
              AllOf(HasSubstr("the last check of golden unit G0, recorded at"),
                    HasSubstr("did not agree with the reference"),
                    HasSubstr("give the station another name")));
  check(3640.0, true, "G0");
  EXPECT_EQ(why(), "");
  check(12.0, false, "G2");
  check(11.0, true, "G3");
  EXPECT_THAT(why(), HasSubstr("the last check of golden unit G2, recorded at"));
  check(9.0, true, "G2");
  EXPECT_EQ(why(), "");
  check(10.0, false);
  EXPECT_THAT(why(), HasSubstr("did not agree"));
  // Judged later, but recorded before it did not agree.
  check(15.0, true);
  EXPECT_THAT(why(), HasSubstr("did not agree"));
  check(-7200.0, true);
  EXPECT_THAT(why(), HasSubstr("is 2 h in the future"));
}

TEST(PlanWork, RefusesWhatIsWrongWhateverSensorsALogHas) {
  for (const char* item : {"limits.accelerometer.bias=-1",
                           "robust.loss=never",
                           "limits.nothing=1",
                           "limits.magnetometer.bias=5" /* of an unknown field */}) {
    EXPECT_FALSE(PlanWork("", {item}, {})) << item;
  }
  EXPECT_TRUE(PlanWork("", {"limits.gyroscope.bias=1"}, {}));
}

TEST(PlanWork, KnowsTheStationOfTheTagsOrTheExperiment) {
  EXPECT_EQ(PlanWork("", {"run.station=\"S3\"", "robust.loss=none"}, {})->tags.station, "S3");
  const TemporaryFolder folder;
  const std::string experiment = folder.Write(
      "experiment.yaml", "experiment: 1\nrun: { station: S4 }\nsensors: { accelerometer: {} }\n");
  EXPECT_EQ(PlanWork(experiment, {}, {})->tags.station, "S4");
}

}  // namespace fleet_engine_test
}  // namespace truetriad::fleet
