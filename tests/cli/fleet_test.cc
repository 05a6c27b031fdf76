// SPDX-License-Identifier: Apache-2.0
// Many units at once.
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace fleet_test {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

class Fleet : public ::testing::Test {
 protected:
  void WriteUnits(int count, int rests = 12) {
    for (int i = 0; i < count; ++i) {
      LogOptions options;
      options.magnetometer = false;
      options.rests = rests;
      options.seed = static_cast<std::uint64_t>(i + 1);
      const std::string number = std::to_string(i);
      folder_.Write("line/u" + std::string(3 - number.size(), '0') + number + ".csv",
                    LogText(options));
    }
  }
  void SetUp() override { fs::create_directories(folder_.Path("line")); }

  /// A line of shell around `truetriad fleet run`, in the folder.
  Finished Run(const std::string& flags, const std::string& before = "") const {
    return RunShell(before + " '" TRUETRIAD_BINARY "' fleet run line " + flags, folder_.Path(""));
  }
  /// The lines of the answer below its header.
  std::vector<std::string> Ask(const std::string& sql, const std::string& store = "fleet") const {
    const Finished run = RunShell(
        "'" TRUETRIAD_BINARY "' fleet query --csv --store=" + store + "/fleet.db \"" + sql + "\"",
        folder_.Path(""));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::istringstream text(run.out);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    if (!lines.empty()) lines.erase(lines.begin());
    return lines;
  }
  std::vector<std::string> Parameters(const std::string& store) const {
    return Ask(
        "SELECT serial, verdict, name, value, sigma FROM run JOIN parameter USING (run) ORDER BY "
        "serial, place",
        store);
  }

  const TemporaryFolder folder_;
};

TEST_F(Fleet, KeepsEveryUnitWithItsVerdictAndFiles) {
  WriteUnits(4);
  folder_.Write("line/short.csv", LogText({.rests = 2}));
  folder_.Write("line/bad.csv", "time[s],accel_x[m/s^2]\n0,x\n");
  const Finished run =
      Run("--to=json --tag=lot=L17 --set=limits.accelerometer.bias=0.25 --fail-on=unit");
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(run.out, AllOf(StartsWith("6 OF 6 NOT GOOD"), HasSubstr("4 FAIL")));
  EXPECT_THAT(Ask("SELECT serial, verdict, code FROM latest ORDER BY serial"),
              ::testing::ElementsAre(StartsWith("bad,NO_RESULT,"),
                                     StartsWith("short,NO_RESULT,"),
                                     "u000,FAIL,limit:accelerometer.bias.z",
                                     "u001,FAIL,limit:accelerometer.bias.z",
                                     "u002,FAIL,limit:accelerometer.bias.z",
                                     "u003,FAIL,limit:accelerometer.bias.z"));
  EXPECT_THAT(Ask("SELECT value FROM tag WHERE name = 'lot'"), SizeIs(6));
  for (const std::string& line : Ask("SELECT folder FROM run WHERE verdict = 'FAIL'")) {
    for (const char* file : {"calibration.yaml", "calibration.json", "report.html"}) {
      EXPECT_TRUE(fs::exists(line + "/" + file)) << line << " " << file;
    }
    // Nothing that firmware could read.
    EXPECT_FALSE(fs::exists(line + "/export.json")) << line;
  }
  // Each as `calibrate` makes it.
  const Finished alone =
      RunShell("'" TRUETRIAD_BINARY
               "' calibrate line/u002.csv -o alone --set=limits.accelerometer.bias=0.25",
               folder_.Path(""));
  EXPECT_EQ(alone.exit_code, 4);
  const std::string folder = Ask("SELECT folder FROM run WHERE serial = 'u002'").front();
  EXPECT_EQ(RunShell("'" TRUETRIAD_BINARY "' compare alone/calibration.yaml " + folder +
                         "/calibration.yaml",
                     folder_.Path(""))
                .exit_code,
            0);
}

TEST_F(Fleet, LosesOneRunToWhatACrashHangOrMemoryCosts) {
  WriteUnits(6);
  const std::map<std::string, std::string> endings = {
      {"crash", "crashed"}, {"hang", "time-limit"}, {"memory", "memory-limit"}};
  for (const auto& [fault, ending] : endings) {
    const Finished run = Run("--report=false --jobs=2 --time-limit=10 -o " + fault,
                             "TRUETRIAD_FLEET_FAULT=" + fault + ":u003");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(
        Ask("SELECT serial, CASE code WHEN '' THEN verdict ELSE code END FROM run ORDER BY serial",
            fault),
        ::testing::ElementsAre("u000,NO_LIMITS",
                               "u001,NO_LIMITS",
                               "u002,NO_LIMITS",
                               "u003," + ending,
                               "u004,NO_LIMITS",
                               "u005,NO_LIMITS"));
  }
}

// The disk is full for a while: no unit is blamed for it, none is lost.
TEST_F(Fleet, EndsOnAFullDiskAndLosesNothing) {
  WriteUnits(6);
  const std::string disk = folder_.Path("fleet");
  fs::create_directory(disk);
  if (RunShell("mount -t tmpfs -o size=1m tmpfs '" + disk + "'").exit_code != 0) {
    GTEST_SKIP() << "mounting a file system is not allowed here";
  }
  RunShell("head -c 800k /dev/zero > '" + disk + "/ballast'");
  const Finished full = Run("");
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, ::testing::AnyOf(HasSubstr("No space left"), HasSubstr("disk is full")));
  fs::remove(disk + "/ballast");
  EXPECT_EQ(Run("--report=false --resume").exit_code, 0);
  EXPECT_THAT(Ask("SELECT DISTINCT serial FROM run WHERE verdict = 'NO_LIMITS'"), SizeIs(6));
  RunShell("umount '" + disk + "'");
}

TEST_F(Fleet, ResumesWithWhatIsMissingOrHasChanged) {
  WriteUnits(5);
  ASSERT_EQ(Run("--report=false").exit_code, 0);
  EXPECT_THAT(Run("--report=false --resume").out, StartsWith("NOTHING TO DO"));
  folder_.Write("line/u002.csv", LogText({.rests = 13, .magnetometer = false}));
  EXPECT_THAT(Run("--report=false --resume").out, HasSubstr("  1 unit in"));
  EXPECT_THAT(Run("--report=false --resume --set=robust.loss=none").out, HasSubstr("5 units"));
  // Runs of before are kept.
  EXPECT_THAT(Ask("SELECT run FROM run"), SizeIs(11));
  EXPECT_THAT(Ask("SELECT run FROM latest"), SizeIs(5));
}

// Tags of the call label what is run now; those of a list are of its logs.
TEST_F(Fleet, ResumesWithWhatTheListHasCorrected) {
  WriteUnits(2);
  const std::string run = "'" TRUETRIAD_BINARY "' fleet run --report=false --resume ";
  const auto done = [&](const std::string& list, const std::string& flags = "") {
    folder_.Write("list.csv", "log,serial,lot\n" + list);
    return RunShell(run + "list.csv " + flags, folder_.Path("")).out;
  };
  EXPECT_THAT(done("line/u000.csv,A0,L1\nline/u001.csv,A1,L1\n"), HasSubstr("  2 units in"));
  EXPECT_THAT(done("line/u000.csv,A0,L1\nline/u001.csv,A1,L1\n", "--tag=station=S2"),
              StartsWith("NOTHING TO DO"));
  EXPECT_THAT(RunShell(run + "line --tag=lot=L9", folder_.Path("")).out,
              StartsWith("NOTHING TO DO"));
  EXPECT_THAT(done("line/u000.csv,A0,L2\nline/u001.csv,A1,L1\n"), HasSubstr("  1 unit in"));
  EXPECT_THAT(done("line/u000.csv,A0,L2\nline/u001.csv,A7,L1\n"), HasSubstr("  1 unit in"));
  EXPECT_THAT(Ask("SELECT serial, value FROM latest JOIN tag USING (run) ORDER BY serial"),
              ::testing::ElementsAre("A0,L2", "A1,L1", "A7,L1"));
}

TEST_F(Fleet, IsResumedByOneAtATime) {
  WriteUnits(1);
  fs::create_directories(folder_.Path("fleet"));
  const Finished run = Run("--resume", "flock fleet/.lock");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("in use by another"));
  // Shards share no log.
  const std::string shard = "--resume --report=false --shard=";
  EXPECT_EQ(Run(shard + "0/2", "flock fleet/.lock-0-of-2").exit_code, 2);
  EXPECT_EQ(Run(shard + "1/2", "flock fleet/.lock-0-of-2").exit_code, 0);
}

// What a file is called is nobody's to obey.
// Two units whose logs are called the same are not one that was measured again.
TEST_F(Fleet, TakesNoNameOfTwoLogsForASerialNumber) {
  LogOptions options;
  options.magnetometer = false;
  for (const char* folder : {"line/a", "line/b"}) fs::create_directories(folder_.Path(folder));
  folder_.Write("line/a/log.csv", LogText(options));
  options.seed = 7;
  folder_.Write("line/b/log.csv", LogText(options));
  const Finished run = Run("-o out --report=false --fail-on=unit");
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(run.out, StartsWith("2 OF 2 NOT GOOD"));
  EXPECT_THAT(run.err, HasSubstr("another log has the same file name"));
  EXPECT_THAT(
      Ask("SELECT serial, code FROM standing ORDER BY serial", "out"),
      ::testing::ElementsAre("line/a/log.csv,duplicate-key", "line/b/log.csv,duplicate-key"));
  EXPECT_EQ(Run("-o out --report=false '--serial={serial}.csv'").exit_code, 0);
  EXPECT_THAT(Ask("SELECT attempts FROM standing WHERE serial = 'log'", "out"),
              ::testing::ElementsAre("2"));
}

TEST_F(Fleet, SaysWhyAUnitIsRedInOneLineThatATerminalMayShow) {
  folder_.Write("line/a\nb\x1B[31m.csv", "time[s],accel_x[m/s^2]\n0,x\n");
  const Finished run = Run("--report=false '--serial={serial}.csv'");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, StartsWith("a\\u000Ab\\u001B[31m: NO RESULT, "));
  EXPECT_THAT(run.err, HasSubstr(".csv): line/a"));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
}

TEST_F(Fleet, FinishesTheUnitsInHandWhenItIsStopped) {
  WriteUnits(12, 60);
  const Finished run =
      RunShell("{ '" TRUETRIAD_BINARY
               "' fleet run line --report=false --jobs=1 --progress=jsonl 2>err & run=$!; "
               "await '[ -s err ]'; kill -TERM $run; wait $run; }",
               folder_.Path(""));
  EXPECT_THAT(run.exit_code, ::testing::AnyOf(143, 0)) << run.err;
  const std::vector<std::string> done = Ask("SELECT verdict FROM run");
  for (const std::string& verdict : done) EXPECT_EQ(verdict, "NO_LIMITS");
  EXPECT_EQ(Run("--report=false --resume").exit_code, 0);
  EXPECT_THAT(Ask("SELECT run FROM run"), SizeIs(12));
}

// It is stopped while the second unit is in hand, which ends by its time limit.
TEST_F(Fleet, SaysToProgramsThatItWasStopped) {
  WriteUnits(3);
  const Finished run =
      RunShell("{ TRUETRIAD_FLEET_FAULT=hang:u001 '" TRUETRIAD_BINARY
               "' fleet run line --report=false --jobs=1 --time-limit=3 --json --progress=jsonl "
               "2>err & run=$!; await '[ -s err ]'; kill -TERM $run; wait $run; }",
               folder_.Path(""));
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_THAT(run.out, AllOf(StartsWith("{"), HasSubstr("\"stopped\"")));
  EXPECT_THAT(Ask("SELECT code FROM run ORDER BY serial"),
              ::testing::ElementsAre("", "time-limit"));
}

TEST_F(Fleet, IsSharedAmongShards) {
  WriteUnits(8);
  for (const char* shard : {"0/3", "1/3", "2/3"}) {
    ASSERT_EQ(Run("--report=false --shard=" + std::string(shard)).exit_code, 0);
  }
  EXPECT_THAT(Ask("SELECT DISTINCT serial FROM run"), SizeIs(8));
  EXPECT_THAT(Ask("SELECT run FROM run"), SizeIs(8));
  EXPECT_EQ(Run("--shard=3/3").exit_code, 1);
  const Finished other = Run("--shard=0/4");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("its shard count is 3"));
}

// A serial number stays one: in SQL, in names, in CSV, JSON and HTML.
TEST_F(Fleet, TakesAnySerialNumber) {
  WriteUnits(2);
  folder_.Write("list.csv",
                "log,serial\nline/u000.csv,\"../a'; \"\"b\"\"\"\n"
                "line/u001.csv,<script>1</script>\n");
  fs::copy_file(folder_.Path("line/u000.csv"), folder_.Path("line/c\nd.csv"));
  const Finished run = RunShell("'" TRUETRIAD_BINARY "' fleet run list.csv && '" TRUETRIAD_BINARY
                                "' fleet run line/c*d.csv '--serial={serial}.csv' --progress=jsonl",
                                folder_.Path(""));
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(Ask("SELECT serial FROM unit ORDER BY serial"),
              ::testing::ElementsAre("\"../a'; \"\"b\"\"\"", "<script>1</script>", "\"c", "d\""));
  EXPECT_THAT(run.err, HasSubstr("\"serial\":\"c\\nd\""));
  EXPECT_TRUE(fs::exists(folder_.Path("fleet/units/%2E.%2Fa%27%3B%20%22b%22")));
  EXPECT_FALSE(fs::exists(folder_.Path("fleet/a'; \"b\"")));
  const std::string page = TemporaryFolder::Read(
      Ask("SELECT folder FROM run WHERE serial LIKE '<%'").front() + "/report.html");
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;1"));
  EXPECT_THAT(page, ::testing::Not(HasSubstr("<script>1")));
}

// Its reports are those of a run without, but for where the style is.
TEST_F(Fleet, SharesTheStyleOfItsReports) {
  WriteUnits(1);
  ASSERT_EQ(Run("-o own").exit_code, 0);
  ASSERT_EQ(Run("-o shared --assets=shared").exit_code, 0);
  const auto report = [&](const std::string& output) {
    const std::string folder = Ask("SELECT folder FROM run", output).front();
    return TemporaryFolder::Read(folder + "/report.html");
  };
  const std::string own = report("own"), shared = report("shared");
  EXPECT_THAT(shared,
              AllOf(HasSubstr("href=\"../../assets/report.css\""), Not(HasSubstr("--ink:"))));
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("shared/units/assets/report.css")),
              HasSubstr("--ink:"));
  // Down to the moment that they were made at.
  const auto body = [](const std::string& html) {
    return html.substr(html.find("<section>"), html.find("<pre>") - html.find("<section>"));
  };
  EXPECT_EQ(body(shared), body(own));
  EXPECT_EQ(Run("--assets=none").exit_code, 1);
}

TEST_F(Fleet, WritesAPageOfItsUnits) {
  WriteUnits(3);
  ASSERT_EQ(Run("-o day --assets=shared --tag=lot=L17").exit_code, 0);
  const std::string report = "'" TRUETRIAD_BINARY "' fleet report --store=day/fleet.db ";
  const Finished page = RunShell(report + "-o day/page", folder_.Path(""));
  EXPECT_EQ(page.exit_code, 0) << page.err;
  EXPECT_THAT(page.out, AllOf(StartsWith("day/page/index.html\n"), HasSubstr("3 of 3 runs")));
  EXPECT_EQ(RunShell(report + "-o day/page --where=\"lot = 'L17'\"", folder_.Path("")).exit_code,
            0);
  folder_.Write("day/index.html", "<p>mine");
  const Finished refused = RunShell(report + "-o day", folder_.Path(""));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("name another folder"));
  EXPECT_EQ(RunShell(report + "-o other --where=nonsense", folder_.Path("")).exit_code, 1);
  EXPECT_FALSE(fs::exists(folder_.Path("other")));
}

TEST_F(Fleet, SaysWhatIsWrongWithTheCall) {
  WriteUnits(2);
  folder_.Write("one.yaml",
                "experiment: 1\ndevice: { serial: A0001 }\nsensors: { accelerometer: {} }\n");
  const std::map<std::string, std::string> mistakes = {
      {"--to=px5", "did you mean `px4`"},
      {"--time-limit=0", "--time-limit"},
      {"--memory-limit=1", "--memory-limit"},
      {"--shard=4", "expected I/N"},
      {"--jobs=-1", "--jobs"},
      {"--jobs=2147483647", "0 to 1000"},
      {"-c one.yaml", "one.yaml:2: device.serial is `A0001`, which would apply to 2 logs"},
      {"--serial=x", "{serial}"},
      {"--store=mysql://x", "looks like a connection to a server"},
      {"nothing.csv", "there is no such log"},
  };
  for (const auto& [flags, message] : mistakes) {
    const Finished run = Run(flags);
    EXPECT_THAT(run.exit_code, ::testing::AnyOf(1, 2)) << flags;
    EXPECT_THAT(run.err, HasSubstr(message)) << flags;
  }
  EXPECT_EQ(Run("--progress=x").exit_code, 1);
  EXPECT_THAT(RunTruetriad({"fleet"}).err, HasSubstr("needs a second word"));
}

}  // namespace fleet_test
}  // namespace truetriad
