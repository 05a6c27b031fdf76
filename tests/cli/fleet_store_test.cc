// SPDX-License-Identifier: Apache-2.0
// Stores that several processes write to, that go away, or that are full.
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"
#include "support/private_postgres.h"

namespace truetriad {
namespace fleet_store_test {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

constexpr char kFleetProgram[] = "'" TRUETRIAD_BINARY "' fleet ";

class FleetStore : public ::testing::Test {
 protected:
  void WriteUnits(int count) {
    fs::create_directories(folder_.Path("line"));
    for (int i = 0; i < count; ++i) {
      LogOptions options;
      options.magnetometer = false;
      options.rests = 12;
      options.seed = static_cast<std::uint64_t>(i + 1);
      folder_.Write("line/u" + std::to_string(100 + i) + ".csv", LogText(options));
    }
  }
  /// Another recording of the first unit.
  void MeasureAgain(std::uint64_t seed) {
    LogOptions options;
    options.magnetometer = false;
    options.rests = 12;
    options.seed = seed;
    folder_.Write("line/u100.csv", LogText(options));
  }
  Finished Shell(const std::string& line) const { return RunShell(line, folder_.Path("")); }
  /// `fleet run` on all units, without reports.
  static std::string Fleet(const std::string& flags) {
    return kFleetProgram + ("run line --report=false --quiet " + flags);
  }
  /// The lines of the answer below its header.
  std::vector<std::string> Ask(const std::string& store, const std::string& sql) const {
    const Finished run =
        Shell(kFleetProgram + ("query --csv '--store=" + store + "' \"") + sql + '"');
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::istringstream text(run.out);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    if (!lines.empty()) lines.erase(lines.begin());
    return lines;
  }
  std::vector<std::string> Parameters(const std::string& store) const {
    return Ask(store,
               "SELECT serial, verdict, name, value, sigma FROM run JOIN parameter USING (run) "
               "ORDER BY serial, place");
  }

  const TemporaryFolder folder_;
};

TEST_F(FleetStore, IsLeftWholeByAFullDisk) {
  WriteUnits(8);
  fs::create_directory(folder_.Path("disk"));
  if (Shell("mount -t tmpfs -o size=1m tmpfs disk").exit_code != 0) {
    GTEST_SKIP() << "mounting a file system is not allowed here";
  }
  const std::string run = Fleet("-o out --store=disk/fleet.db --jobs=1");
  EXPECT_EQ(Shell(kFleetProgram + std::string("run line/u100.csv --report=false --quiet -o out "
                                              "--store=disk/fleet.db"))
                .exit_code,
            0);
  Shell("cat /dev/zero >disk/ballast");
  const Finished full = Shell(run);
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("free disk space, and continue with --resume"));
  Shell("rm disk/ballast");
  EXPECT_THAT(Ask("disk/fleet.db", "SELECT serial FROM run"), Not(SizeIs(0)));
  EXPECT_EQ(Shell(run + " --resume").exit_code, 0);
  EXPECT_THAT(Ask("disk/fleet.db", "SELECT DISTINCT serial FROM run"), SizeIs(8));
  EXPECT_THAT(Ask("disk/fleet.db", "SELECT run FROM run"), SizeIs(8));
  Shell("umount disk");
}

TEST_F(FleetStore, WithdrawsTheExportsOfAUnitThatAPersonRefuses) {
  WriteUnits(1);
  const std::string run = Fleet("--store=a.db --to=px4,record");
  ASSERT_EQ(Shell(run).exit_code, 0);
  const auto folders = [&] { return Ask("a.db", "SELECT folder FROM run ORDER BY run"); };
  const std::string folder = folders().at(0);
  ASSERT_TRUE(fs::exists(folder + "/px4.params"));
  const auto decide = [&](const std::string& verdict) {
    return Shell(kFleetProgram +
                 std::string("dispose u100 --store=a.db --who='R. Roe' --why=bent ") +
                 "--verdict=" + verdict);
  };
  ASSERT_EQ(decide("FAIL").exit_code, 0);
  EXPECT_FALSE(fs::exists(folder + "/px4.params"));
  EXPECT_TRUE(fs::exists(folder + "/px4.params.withdrawn"));
  EXPECT_FALSE(fs::exists(folder + "/record.html"));  // It said otherwise.
  // The same recording again is the same unit.
  ASSERT_EQ(Shell(run).exit_code, 0);
  EXPECT_FALSE(fs::exists(folders().at(1) + "/px4.params"));
  const std::string to_export =
      "'" TRUETRIAD_BINARY "' export '" + folder + "/calibration.yaml' --to=px4 --output=u.params";
  const Finished refused = Shell(to_export);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("FAIL by R. Roe on "));
  EXPECT_FALSE(fs::exists(folder_.Path("u.params")));
  EXPECT_EQ(Shell(to_export + " --outside-limits=allow").exit_code, 0);
  // A concession is about the run that counts.
  ASSERT_EQ(decide("PASS").exit_code, 0);
  EXPECT_EQ(Shell(to_export).exit_code, 2);
  EXPECT_EQ(Shell("'" TRUETRIAD_BINARY "' export '" + folders().at(1) +
                  "/calibration.yaml' --to=px4 --output=u.params")
                .exit_code,
            0);
}

TEST_F(FleetStore, HoldsBackEarlierRunsOfAUnitThatFailsWhenItIsMeasuredAgain) {
  WriteUnits(1);
  const auto run = [&](const std::string& limit) {
    return Shell(
        kFleetProgram +
        ("run line --report=false -o out --to=px4 --set=limits.accelerometer.bias=" + limit));
  };
  ASSERT_EQ(run("5").exit_code, 0);
  const std::string folder = Ask("out/fleet.db", "SELECT folder FROM run").at(0);
  ASSERT_TRUE(fs::exists(folder + "/px4.params"));
  MeasureAgain(7);
  const Finished fails = run("0.0001");
  EXPECT_THAT(fails.err, HasSubstr("renamed to *.withdrawn"));
  EXPECT_FALSE(fs::exists(folder + "/px4.params"));
  const std::string to_export =
      "'" TRUETRIAD_BINARY "' export '" + folder + "/calibration.yaml' --to=px4 --output=u.params";
  const Finished refused = Shell(to_export);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("it is the unit's current run, and is FAIL"));
  // What passes later lifts it; what was withdrawn is exported again.
  MeasureAgain(8);
  ASSERT_EQ(run("5").exit_code, 0);
  const Finished exported = Shell(to_export);
  EXPECT_EQ(exported.exit_code, 0);
  EXPECT_THAT(exported.err,
              HasSubstr("another run is the current run of this unit; the unit is PASS"));
  EXPECT_THAT(Shell("'" TRUETRIAD_BINARY "' export \"$(ls -d out/units/u100/* | tail -n 1)\"/"
                    "calibration.yaml --to=px4 --output=u.params")
                  .err,
              Not(HasSubstr("another run")));
}

TEST_F(FleetStore, ExportsNothingOfAUnitThatWasRefusedWhileItsFilesWereAway) {
  WriteUnits(1);
  ASSERT_EQ(Shell(kFleetProgram + std::string("run line --report=false -o out")).exit_code, 0);
  const Finished decided = Shell(
      "mv out/units away && " +
      (kFleetProgram +
       std::string("dispose u100 --store=out/fleet.db --who='R. Roe' --why=bent --verdict=FAIL; "
                   "code=$?; mv away out/units; exit $code")));
  EXPECT_EQ(decided.exit_code, 4);
  const std::string to_export = "'" TRUETRIAD_BINARY
                                "' export out/units/u100/*/calibration.yaml --to=record "
                                "--output=u.html";
  const Finished refused = Shell(to_export);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("FAIL by R. Roe on "));
  EXPECT_FALSE(fs::exists(folder_.Path("u.html")));
}

// The later log holds nothing: its run has no files.
TEST_F(FleetStore, HoldsBackEarlierRunsOfAUnitWhoseLogCannotBeRead) {
  WriteUnits(1);
  const std::string run =
      kFleetProgram + std::string("run line --report=false --store=a.db --to=px4");
  ASSERT_EQ(Shell(run).exit_code, 0);
  const std::string folder = Ask("a.db", "SELECT folder FROM run").at(0);
  ASSERT_TRUE(fs::exists(folder + "/px4.params"));
  Shell("for log in line/*.csv; do : > $log; done");
  EXPECT_THAT(Shell(run).err, HasSubstr("1 exported file is renamed to *.withdrawn"));
  EXPECT_FALSE(fs::exists(folder + "/px4.params"));
  const Finished refused = Shell("'" TRUETRIAD_BINARY "' export '" + folder +
                                 "/calibration.yaml' --to=px4 --output=u.params");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("it is the unit's current run, and has no calibration"));
}

TEST_F(FleetStore, MakesUpForWhatEarlierRunsCouldNotBeTold) {
  WriteUnits(1);
  const std::string fleet = "run line --report=false -o out --to=px4 --retest-counts=";
  const auto run = [&](const std::string& limit, const std::string& flags = "last") {
    return Shell(kFleetProgram + fleet + flags + " --set=limits.accelerometer.bias=" + limit);
  };
  ASSERT_EQ(run("5").exit_code, 0);
  const std::string folder = Ask("out/fleet.db", "SELECT folder FROM run").at(0);
  fs::rename(folder, folder_.Path("away"));
  MeasureAgain(7);
  const Finished fails = run("0.0001");
  EXPECT_EQ(fails.exit_code, 4);
  EXPECT_THAT(fails.err, HasSubstr("`export` of these files does not notice the unit's verdict"));
  EXPECT_THAT(fails.out, HasSubstr("files of earlier runs could not be changed"));
  fs::rename(folder_.Path("away"), folder);
  ASSERT_TRUE(fs::exists(folder + "/px4.params"));
  const Finished resumed = run("0.0001", "last --resume");
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("1 exported file is renamed to *.withdrawn"));
  EXPECT_TRUE(fs::exists(folder + "/px4.params.withdrawn"));
  // What a person decides meanwhile, too.
  fs::rename(folder, folder_.Path("away"));
  MeasureAgain(8);
  ASSERT_EQ(run("5").exit_code, 0);
  const std::string last = Ask("out/fleet.db", "SELECT folder FROM run ORDER BY run DESC").at(0);
  ASSERT_TRUE(fs::exists(last + "/px4.params"));
  fs::rename(last, folder_.Path("away-too"));
  EXPECT_EQ(Shell(kFleetProgram + std::string("dispose u100 --store=out/fleet.db --who=me "
                                              "--verdict=FAIL --why=bent"))
                .exit_code,
            4);
  fs::rename(folder_.Path("away-too"), last);
  fs::rename(folder_.Path("away"), folder);
  EXPECT_EQ(run("5", "last --resume").exit_code, 0);
  EXPECT_FALSE(fs::exists(last + "/px4.params"));
  // All is said: nothing is said again.
  EXPECT_THAT(run("0.0001", "last --resume").err, Not(HasSubstr("withdrawn")));
}

TEST_F(FleetStore, EndsAConcessionWithTheNextRunThatCounts) {
  WriteUnits(1);
  const auto run = [&](const std::string& limit) {
    return Shell(
        kFleetProgram +
        ("run line --report=false --quiet -o out --set=limits.accelerometer.bias=" + limit));
  };
  ASSERT_EQ(run("0.0001").exit_code, 0);
  const std::string folder = Ask("out/fleet.db", "SELECT folder FROM run").at(0);
  ASSERT_EQ(Shell(kFleetProgram + std::string("dispose u100 --store=out/fleet.db --who=me "
                                              "--verdict=PASS --why=spare"))
                .exit_code,
            0);
  const auto may_leave = [&] {
    return Shell("'" TRUETRIAD_BINARY "' export '" + folder +
                 "/calibration.yaml' --to=px4 --output=u.params")
               .exit_code == 0;
  };
  EXPECT_TRUE(may_leave());
  MeasureAgain(7);
  // What was conceded is told when it is there again.
  fs::rename(folder, folder_.Path("away"));
  EXPECT_EQ(run("0.0001").exit_code, 4);
  fs::rename(folder_.Path("away"), folder);
  EXPECT_FALSE(may_leave());  // The store says so before the file does.
  const auto says = [&] { return TemporaryFolder::Read(folder + "/calibration.yaml"); };
  EXPECT_THAT(says(), HasSubstr("spare"));
  EXPECT_EQ(run("0.0001").exit_code, 0);
  EXPECT_THAT(says(), Not(HasSubstr("spare")));
  MeasureAgain(8);
  ASSERT_EQ(run("5").exit_code, 0);
  EXPECT_FALSE(may_leave());
}

TEST_F(FleetStore, ForgetsARefusalThatWasTakenBack) {
  WriteUnits(1);
  const std::string run = kFleetProgram + std::string("run line --report=false --quiet -o out");
  ASSERT_EQ(Shell(run).exit_code, 0);
  const std::string folder = Ask("out/fleet.db", "SELECT folder FROM run").at(0);
  for (const char* verdict : {"FAIL", "PASS"}) {
    ASSERT_EQ(Shell(kFleetProgram +
                    std::string("dispose u100 --store=out/fleet.db --who=me "
                                "--why=x --verdict=") +
                    verdict)
                  .exit_code,
              0);
  }
  MeasureAgain(7);
  ASSERT_EQ(Shell(run).exit_code, 0);
  EXPECT_EQ(Shell("'" TRUETRIAD_BINARY "' export '" + folder +
                  "/calibration.yaml' --to=px4 --output=u.params")
                .exit_code,
            0);
}

TEST_F(FleetStore, WithdrawsWhatShardsExportedWhenTheyAreCollected) {
  WriteUnits(1);
  const auto run = [&](const std::string& store, const std::string& limit) {
    return Shell(kFleetProgram + ("run line --report=false --quiet -o day --to=px4 --store=day/" +
                                  store + " --set=limits.accelerometer.bias=" + limit))
        .exit_code;
  };
  ASSERT_EQ(run("0.jsonl", "5"), 0);
  MeasureAgain(7);
  ASSERT_EQ(run("1.jsonl", "0.0001"), 0);
  EXPECT_EQ(Shell("ls day/units/u100/*/px4.params").exit_code, 0);
  const std::string collect = kFleetProgram + std::string("collect day/0.jsonl day/1.jsonl ");
  const Finished done = Shell(collect + "--store=day/all.db");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("1 exported file is renamed to *.withdrawn"));
  EXPECT_NE(Shell("ls day/units/u100/*/px4.params").exit_code, 0);
  fs::remove_all(folder_.Path("day/units"));
  EXPECT_EQ(Shell(collect + "--store=other.db").exit_code, 4);
}

TEST_F(FleetStore, DecidesAboutTheFilesThatWereCopiedWithIt) {
  WriteUnits(1);
  ASSERT_EQ(Shell(kFleetProgram + std::string("run line --quiet -o out --to=px4")).exit_code, 0);
  const std::string folder = Ask("out/fleet.db", "SELECT folder FROM run").at(0);
  fs::copy(folder_.Path("out"), folder_.Path("copy"), fs::copy_options::recursive);
  const std::string dispose =
      kFleetProgram + std::string("dispose u100 --who=me --why=bent --verdict=FAIL --store=");
  const Finished done = Shell(dispose + "copy/fleet.db");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("Withdrawn: "));
  EXPECT_TRUE(fs::exists(folder + "/px4.params"));
  const std::string copied =
      folder_.Path("copy/units") + "/u100/" + fs::path(folder).filename().string();
  EXPECT_FALSE(fs::exists(copied + "/px4.params"));
  // The page that stands there says so, too.
  const Finished page = Shell("grep -c 'FAIL by me on ' '" + copied + "/report.html'");
  EXPECT_EQ(page.exit_code, 0);
  EXPECT_EQ(Shell("grep -c 'The recording over time' '" + copied + "/report.html'").exit_code, 0);
  // Files that are nowhere are no decision that holds.
  fs::remove_all(folder_.Path("out/units"));
  const Finished unreached = Shell(dispose + "out/fleet.db");
  EXPECT_EQ(unreached.exit_code, 4);
  EXPECT_THAT(unreached.err, HasSubstr("`export` of these files does not notice this decision"));
}

TEST_F(FleetStore, ExportsWhatTheStoreSaysIntoWhichItsOwnWasCollected) {
  WriteUnits(1);
  const auto run = [&](const std::string& out) {
    return Shell(kFleetProgram + ("run line --report=false --quiet -o " + out) +
                 " --set=limits.accelerometer.bias=" + (out == "first" ? "5" : "0.0001"))
        .exit_code;
  };
  const std::string collect =
      kFleetProgram + std::string("collect first/fleet.db second/fleet.db --store=all/fleet.db");
  const auto export_of = [&](const std::string& out) {
    return Shell("cd " + out +
                 "/units/u100/*/ && '" TRUETRIAD_BINARY
                 "' export --calibration=calibration.yaml --to=px4 --id=7 -o px4.params");
  };
  ASSERT_EQ(run("first"), 0);
  ASSERT_EQ(export_of("first").exit_code, 0);
  MeasureAgain(7);
  ASSERT_EQ(run("second"), 0);
  const Finished collected = Shell(collect);
  EXPECT_THAT(collected.err, HasSubstr("is renamed to *.withdrawn"));
  // The store beside it has the run that is good alone.
  EXPECT_EQ(export_of("first").exit_code, 2);
  EXPECT_EQ(export_of("second").exit_code, 2);
  EXPECT_EQ(Shell(kFleetProgram + std::string("dispose u100 --who=me --why=ok --verdict=PASS "
                                              "--store=all/fleet.db"))
                .exit_code,
            0);
  EXPECT_EQ(export_of("second").exit_code, 0);
}

// Neither a comment nor gzip nor another zero of its times makes another recording.
TEST_F(FleetStore, HoldsADecisionOverTheSameReadings) {
  WriteUnits(1);
  ASSERT_EQ(Shell(Fleet("-o out")).exit_code, 0);
  ASSERT_EQ(Shell(kFleetProgram + std::string("dispose u100 --store=out/fleet.db --who=me "
                                              "--verdict=FAIL --why=bent"))
                .exit_code,
            0);
  ASSERT_EQ(Shell("echo '# Seen.' >> line/u100.csv").exit_code, 0);
  EXPECT_EQ(Shell(Fleet("-o out --fail-on=unit")).exit_code, 4);
  ASSERT_EQ(Shell("awk -F, -v OFS=, '/^[0-9]/ { $1 += 100 } 1' line/u100.csv > later.csv && "
                  "mv later.csv line/u100.csv && gzip line/u100.csv")
                .exit_code,
            0);
  const Finished packed = Shell(Fleet("-o out --fail-on=unit '--serial={serial}.csv*'"));
  EXPECT_EQ(packed.exit_code, 4);
  EXPECT_EQ(packed.err, "");
  EXPECT_THAT(Ask("out/fleet.db", "SELECT final_verdict, attempts FROM standing"),
              ElementsAre("FAIL,1"));
  // Left out, the unit is not good either.
  const Finished resumed = Shell(Fleet("-o out --fail-on=unit --resume '--serial={serial}.csv*'"));
  EXPECT_EQ(resumed.exit_code, 4);
  EXPECT_THAT(resumed.out, StartsWith("1 OF 1 SKIPPED UNITS NOT GOOD"));
  // What lifts a decision is said in any case.
  fs::remove(folder_.Path("line/u100.csv.gz"));
  MeasureAgain(9);
  EXPECT_THAT(
      Shell(Fleet("-o out")).err,
      AllOf(StartsWith("warning: u100: run "), HasSubstr("does not lift the decision of me")));
  // What was measured later does, where that is said.
  MeasureAgain(10);
  ASSERT_EQ(
      Shell("sleep 1.1; (echo log,recorded; date -u +line/u100.csv,%FT%TZ) > later.csv").exit_code,
      0);
  EXPECT_THAT(Shell(kFleetProgram + std::string("run later.csv --quiet -o out")).err,
              AllOf(StartsWith("warning: u100: run "), HasSubstr(" lifts the decision of me")));
}

// As the messages advise, in whatever order.
TEST_F(FleetStore, ExchangesTwoSerialNumbers) {
  WriteUnits(2);
  folder_.Write("wrong.csv",
                "log,serial,recorded\nline/u100.csv,X2,2026-11-28T08:00Z\n"
                "line/u101.csv,X1,2026-11-28T08:10Z\n");
  folder_.Write("right.csv",
                "log,serial,recorded\nline/u100.csv,X1,2026-11-28T08:00Z\n"
                "line/u101.csv,X2,2026-11-28T08:10Z\n");
  const auto run = [&](const std::string& list, const std::string& output) {
    return Shell(kFleetProgram + ("run " + list + " --report=false --to=px4 --quiet -o " + output +
                                  " --set=limits.accelerometer.bias=5 --fail-on=unit --jobs=1"));
  };
  const auto commands_in = [](const std::string& text) {
    std::vector<std::string> commands;
    for (std::size_t at = 0; (at = text.find("`truetriad fleet ", at)) != std::string::npos; ++at) {
      commands.push_back(text.substr(at + 17, text.find('`', at + 1) - at - 17));
    }
    return commands;
  };
  for (const std::string output : {"one", "both"}) {
    ASSERT_EQ(run("wrong.csv", output).exit_code, 0);
    const std::string store = output + "/fleet.db";
    const std::string first = Ask(store, "SELECT folder FROM run WHERE serial = 'X2'").at(0);
    EXPECT_EQ(run("right.csv", output).exit_code, 4);
    std::vector<std::string> commands;
    for (const std::string& message :
         Ask(store, "SELECT message FROM run WHERE code = 'other-device' ORDER BY serial")) {
      for (std::string command : commands_in(message)) commands.push_back(std::move(command));
    }
    ASSERT_EQ(commands.size(), 2u);
    for (const std::string& command : commands) {
      const Finished said = Shell(kFleetProgram + command);
      EXPECT_EQ(said.exit_code, 0) << command << said.err;
      if (output == "one") static_cast<void>(run("right.csv", output));
    }
    const Finished right = run("right.csv", output);
    EXPECT_EQ(right.exit_code, 0) << right.out << right.err;
    EXPECT_THAT(Ask(store, "SELECT serial, log, final_verdict FROM standing ORDER BY serial"),
                ElementsAre("X1,line/u100.csv,PASS", "X2,line/u101.csv,PASS"));
    const std::string given_up = Ask(store, "SELECT run FROM given_up ORDER BY run").at(0);
    EXPECT_THAT(Shell(kFleetProgram + ("dispose X2 --store=" + store +
                                       " --who=R --verdict=FAIL "
                                       "--wrong-serial --why=again --run=" +
                                       given_up))
                    .out,
                AllOf(StartsWith("X2: run " + given_up), HasSubstr("PASS by its current run ")));
    // What was given up leaves under no number.
    EXPECT_FALSE(fs::exists(first + "/px4.params"));
    const Finished refused = Shell("'" TRUETRIAD_BINARY "' export '" + first +
                                   "/calibration.yaml' --to=px4 --output=u.params");
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("wrong serial number: again"));
  }
}

TEST_F(FleetStore, CountsAllUnitsThatAreNotGood) {
  WriteUnits(3);
  ASSERT_EQ(Shell(Fleet("-o out")).exit_code, 0);
  ASSERT_EQ(Shell(kFleetProgram + std::string("dispose u100 --store=out/fleet.db --who=me "
                                              "--verdict=FAIL --why=bent"))
                .exit_code,
            0);
  folder_.Write("line/u102.csv", "");
  EXPECT_THAT(Shell(Fleet("-o out")).out, StartsWith("2 OF 3 NOT GOOD"));
  EXPECT_THAT(Shell(Fleet("-o out --json")).out, HasSubstr("\"not_good\": 2,"));
}

TEST_F(FleetStore, WarnsOfANewStoreBesideAnOutputsOwn) {
  WriteUnits(1);
  EXPECT_EQ(Shell(Fleet("-o out")).err, "");
  EXPECT_THAT(Shell(Fleet("-o out --store=out/flet.db")).err,
              AllOf(HasSubstr("a new store, out/flet.db, is created"), HasSubstr("out/fleet.db")));
  EXPECT_THAT(Shell(Fleet("-o out --store=out/flet.db")).err, Not(HasSubstr("a new store")));
}

// A wrong option says nothing about units.
TEST_F(FleetStore, BeginsNoUnitWithAWrongOption) {
  WriteUnits(1);
  const Finished judged = Shell(Fleet("-o judged --set=limits.accelerometer.bias=9"));
  EXPECT_THAT(judged.out, StartsWith("ALL GOOD"));
  EXPECT_THAT(Shell(Fleet("-o out")).out, StartsWith("ALL USABLE, NO LIMITS SET"));
  const Finished run = Shell(Fleet("-o out --set=limits.accelerometer.bias=-1"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("`-1` is out of range"));
  EXPECT_THAT(Ask("out/fleet.db", "SELECT verdict FROM run"), ElementsAre("NO_LIMITS"));
}

TEST_F(FleetStore, KeepsWhatPeopleDecide) {
  WriteUnits(2);
  ASSERT_EQ(Shell(Fleet("--store=a.db --tag=lot=L17")).exit_code, 0);
  const std::string dispose = kFleetProgram + std::string("dispose ");
  const Finished done =
      Shell(dispose + "u100 --store=a.db --who='R. Roe' --verdict=FAIL --why='bent'");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, StartsWith("u100 is FAIL (run "));
  EXPECT_THAT(
      Ask("a.db", "SELECT serial, verdict, final_verdict, disposed_by FROM standing ORDER BY 1"),
      ElementsAre("u100,NO_LIMITS,FAIL,R. Roe", "u101,NO_LIMITS,NO_LIMITS,"));
  // What somebody has refused is not good because it is calibrated again.
  const Finished again = Shell(Fleet("--store=a.db --tag=lot=L17 --fail-on=unit"));
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.out, StartsWith("1 OF 2 UNITS NOT GOOD"));
  EXPECT_THAT(again.out, HasSubstr("u100: FAIL by R. Roe (bent)"));
  EXPECT_THAT(again.out,
              HasSubstr("2 of these recordings were calibrated before; each counts only once: "
                        "u100, u101"));
  const Finished query =
      Shell(kFleetProgram + std::string("query --store=a.db --where=\"final_verdict = 'FAIL' AND "
                                        "lot = 'L17'\""));
  EXPECT_THAT(query.out, AllOf(StartsWith("serial  final_verdict  verdict"), HasSubstr("R. Roe")));
  const Finished bytes =
      Shell(kFleetProgram + std::string("query --store=a.db \"SELECT covariance FROM run\""));
  EXPECT_THAT(bytes.out, HasSubstr("<blob "));
  EXPECT_THAT(Ask("a.db", "SELECT DISTINCT substr(folder, 1, 1) FROM run"), ElementsAre("/"));
  struct Mistake {
    std::string flags, message;
    int exit_code;
  };
  for (const Mistake& mistake : std::vector<Mistake>{
           {"u7 --store=a.db --who=x --verdict=PASS --why=x", "has no unit `u7`", 1},
           {"u100 --store=a.db --who=x --verdict=good --why=x", "--verdict=good is not known", 1},
           {"u100 --store=a.db --who=x --verdict=crashed --why=x", "expected one of PASS, FAIL", 1},
           {"u100 --store=a.db --who=x --verdict=PASS", "--why=TEXT is missing", 1},
           {"u100 --store=a.db --who=x --verdict=PASS --why=", "--why has no value", 1},
           {"u100 --store=a.db --who=' ' --verdict=PASS --why=x", "who decided it", 1},
           {"u100 --store=b.db --who=x --verdict=PASS --why=x", "there is no such store", 2}}) {
    const Finished run = Shell(dispose + mistake.flags);
    EXPECT_EQ(run.exit_code, mistake.exit_code) << mistake.flags;
    EXPECT_THAT(run.err, HasSubstr(mistake.message));
  }
  EXPECT_THAT(Ask("a.db", "SELECT disposition FROM disposition"), SizeIs(1));
  EXPECT_FALSE(fs::exists(folder_.Path("b.db")));
}

class FleetPostgreSQL : public FleetStore {
 protected:
  void SetUp() override {
    TRUETRIAD_SKIP_WITHOUT_POSTGRES();
    url_ = server()->NewDatabase();
  }
  static PrivatePostgres* server() { return PrivatePostgres::Get(); }
  std::string Store() const { return "'--store=" + url_ + "' "; }
  /// Shell that waits until the process $run has added some runs.
  std::string UntilRuns(int count) const {
    return "until [ \"$(" + server()->PsqlCommand(url_, "SELECT count(*) FROM run") + ")\" -ge " +
           std::to_string(count) + " ] 2>/dev/null || ! kill -0 $run; do sleep 0.02; done";
  }

  std::string url_;
};

TEST_F(FleetPostgreSQL, IsWrittenToByFourAtOnce) {
  WriteUnits(16);
  ASSERT_EQ(Shell(Fleet("-o alone")).exit_code, 0);
  std::string line;
  for (int i = 0; i < 4; ++i) {
    line += Fleet(Store() + "--jobs=1 -o out" + std::to_string(i) +
                  " --shard=" + std::to_string(i) + "/4") +
            " & jobs=\"$jobs $!\"; ";
  }
  const Finished four = Shell(line + "for job in $jobs; do wait $job || exit; done");
  ASSERT_EQ(four.exit_code, 0) << four.err;
  EXPECT_THAT(Ask(url_, "SELECT run FROM run"), SizeIs(16));
  EXPECT_THAT(Parameters(url_), Not(SizeIs(0)));
  EXPECT_EQ(Parameters(url_), Parameters("alone/fleet.db"));
  EXPECT_THAT(Ask(url_, "SELECT value FROM fact WHERE name = 'shards'"), ElementsAre("4"));
  const Finished other = Shell(Fleet(Store() + "--shard=0/5"));
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("its shard count is 4"));
}

TEST_F(FleetPostgreSQL, MayRestartDuringARun) {
  WriteUnits(40);
  const Finished run =
      Shell(Fleet(Store() + "--jobs=1") + " & run=$!; " + UntilRuns(3) + "; " +
            server()->StopCommand() + "; sleep 0.3; " + server()->StartCommand() + "; wait $run");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(Ask(url_, "SELECT run FROM run"), SizeIs(40));
  EXPECT_THAT(Ask(url_, "SELECT DISTINCT serial FROM run"), SizeIs(40));
}

TEST_F(FleetPostgreSQL, MayGoForGoodAndTheRunGoesOnLater) {
  WriteUnits(40);
  const std::string flags = Store() + "--jobs=1 ";
  // The fourth waits, so that the run is not at its end when the server is.
  const Finished cut =
      Shell("export TRUETRIAD_STORE_PATIENCE=0.5 TRUETRIAD_FLEET_FAULT=hang:u103; " + Fleet(flags) +
            " & run=$!; " + UntilRuns(3) + "; " + server()->StopCommand() +
            "; read -r worker </proc/$run/task/$run/children; kill -KILL $worker; wait $run");
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.err,
              AllOf(HasSubstr("not restored within 0.5 s"), HasSubstr("--resume adds the rest")));
  const Finished refused = Shell(Fleet(flags + "--json"));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.out, HasSubstr("\"store-failure\""));
  server()->Start();
  const std::size_t done = Ask(url_, "SELECT run FROM run").size();
  EXPECT_GE(done, 3u);
  EXPECT_EQ(Shell(Fleet(flags + "--resume")).exit_code, 0);
  EXPECT_THAT(Ask(url_, "SELECT run FROM run"), SizeIs(40));
  EXPECT_THAT(Ask(url_, "SELECT DISTINCT serial FROM run"), SizeIs(40));
}

TEST_F(FleetPostgreSQL, TakesAnySerialNumber) {
  WriteUnits(1);
  folder_.Write("list.csv",
                "log,serial\nline/u100.csv,\"'); DROP TABLE run CASCADE; -- $1 \\ \"\"x\"\"\"\n");
  const Finished run = Shell(kFleetProgram + ("run list.csv --report=false " + Store()));
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(Ask(url_, "SELECT serial FROM run"),
              ElementsAre("\"'); DROP TABLE run CASCADE; -- $1 \\ \"\"x\"\"\""));
}

TEST_F(FleetPostgreSQL, AsksNothingThatWasTypedAsASuperuser) {
  WriteUnits(1);
  ASSERT_EQ(Shell(Fleet(Store())).exit_code, 0);
  std::string mighty = url_;
  mighty.replace(mighty.find("line@"), 5, "postgres@");
  for (const char* const verb : {"query \"SELECT pg_reload_conf()\"",
                                 "query --where=\"pg_reload_conf()\"",
                                 "summary --where=\"pg_reload_conf()\"",
                                 "summary --study=\"pg_reload_conf()\"",
                                 "report -o page --where=\"pg_reload_conf()\"",
                                 "export --to=csv -o x --where=\"pg_reload_conf()\""}) {
    const Finished run = Shell(kFleetProgram + std::string(verb) + " '--store=" + mighty + "'");
    EXPECT_EQ(run.exit_code, 1) << verb;
    EXPECT_THAT(run.err, HasSubstr("connect as a role that may only read")) << verb;
  }
  EXPECT_EQ(Shell(kFleetProgram + std::string("query '--store=") + mighty + "'").exit_code, 0);
}

TEST_F(FleetPostgreSQL, DoesNotShowItsPassword) {
  WriteUnits(1);
  std::string url = url_;
  url.insert(url.find('@'), ":hunter2");
  const Finished run = Shell(Fleet("--json '--store=" + url + "'"));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out + run.err,
              AllOf(HasSubstr("postgresql://line@/"), Not(HasSubstr("hunter2"))));
}

}  // namespace fleet_store_test
}  // namespace truetriad
