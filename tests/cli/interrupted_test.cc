// SPDX-License-Identifier: Apache-2.0
//
// Kills, full disks and two writers: what was there stays, or the new is whole.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "math/random.h"
#include "support/log_writer.h"
#include "support/nightly.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace interrupted_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kProgram[] = "'" TRUETRIAD_BINARY "'";

// What a writer has not given its name yet.
std::vector<std::string> LitterIn(const std::string& folder) {
  std::vector<std::string> litter;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.find(".tmp-") != std::string::npos) litter.push_back(name);
  }
  return litter;
}

// Kills with `kill` when some time has passed ($p: the process of truetriad), and waits until
// each process that was started has ended, also one that outlives its parent.
Finished RunKilled(const std::string& line,
                   const std::string& kill,
                   double after_s,
                   const std::string& folder) {
  char moment[32];
  std::snprintf(moment, sizeof moment, "%.4f", after_s);
  return RunShell("exec 9>lock; flock 9; " + line + " & p=$!; exec 9>&-; sleep " + moment + "; " +
                      kill + "; wait $p; status=$?; flock lock true; exit $status",
                  folder);
}

// Moments over all of a run, however quick the machine is now.
class Moments {
 public:
  Moments(double took_s, std::uint64_t seed) : latest_s_(took_s), random_(seed) {}

  double Next() { return 1e-3 + latest_s_ * random_.Uniform(); }
  // Whether it was not too late. Some seven of ten are not, then.
  void Learn(bool was_in_time) { latest_s_ *= was_in_time ? 1.1 : 0.8; }

 private:
  double latest_s_;
  Random random_;
};

double SecondsOf(const std::function<void()>& act) {
  const auto begin = std::chrono::steady_clock::now();
  act();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

struct Writer {
  std::string name;
  std::string command;  // below the folder of the test, where log.csv and golden.yaml are

  friend std::ostream& operator<<(std::ostream& out, const Writer& writer) {
    return out << writer.name;
  }
};

class KilledWriter : public ::testing::TestWithParam<Writer> {
 protected:
  void SetUp() override {
    folder_.Write("log.csv", LogText({.rests = 16}));
    ASSERT_EQ(Run(std::string(kProgram) + " calibrate log.csv -o first").exit_code, 0);
    fs::copy_file(folder_.Path("first/calibration.yaml"), folder_.Path("golden.yaml"));
    fs::create_directory(folder_.Path("out"));
    fs::create_directory(folder_.Path("faces"));
    for (const char* face : {"+x", "-x", "+y", "-y", "+z", "-z"}) {
      const std::string name = std::string("faces/") + face + ".csv";
      folder_.Write(name, LogText({.rests = 1, .rest_s = 5.0, .magnetometer = false}));
    }
  }
  Finished Run(const std::string& line) const { return RunShell(line, folder_.Path(".")); }

  // Under its name a file is whole: the one of the run that was let finish, but for the time.
  void ExpectWhole(const std::map<std::string, std::string>& whole) const {
    for (const auto& [name, text] : FilesIn(folder_.Path("out"))) {
      if (name.find(".tmp-") != std::string::npos) continue;
      const auto found = whole.find(name);
      ASSERT_NE(found, whole.end()) << name;
      if (name.ends_with("calibration.yaml")) {
        EXPECT_TRUE(ReadCalibration(folder_.Path("out/" + name))) << name;
      }
      EXPECT_EQ(text.size(), found->second.size()) << name;
    }
  }

  const TemporaryFolder folder_;
};

TEST_P(KilledWriter, LeavesWholeFilesAndTheNextRunNoLitter) {
  constexpr int kKills = 30;
  const std::string line = std::string(kProgram) + " " + GetParam().command;
  Moments moments(SecondsOf([&] { ASSERT_EQ(Run(line).exit_code, 0); }), 7);
  const std::map<std::string, std::string> whole = FilesIn(folder_.Path("out"));
  ASSERT_FALSE(whole.empty());
  const Patience patience;
  int killed = 0;
  for (int i = 0; killed < kKills && patience.Lasts(); ++i) {
    if (i % 2 == 0) {  // Onto nothing, and onto what is there.
      fs::remove_all(folder_.Path("out"));
      fs::create_directory(folder_.Path("out"));
    }
    const Finished run =
        RunKilled(line, "kill -KILL $p 2>/dev/null", moments.Next(), folder_.Path("."));
    killed += run.exit_code == 0 ? 0 : 1;
    moments.Learn(run.exit_code != 0);
    ExpectWhole(whole);
  }
  EXPECT_EQ(killed, kKills);
  ASSERT_EQ(Run(line).exit_code, 0);
  EXPECT_THAT(LitterIn(folder_.Path(".")), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    KilledWriter,
    ::testing::Values(
        Writer{"Calibrate", "calibrate log.csv -o out --overwrite"},
        Writer{"Apply", "apply --calibration=golden.yaml --input=log.csv --output=out/true.csv"},
        Writer{"Report", "report --calibration=golden.yaml --output=out/report.html"},
        Writer{"Simulate",
               "simulate -c '" TRUETRIAD_SOURCE_DIR
               "/configs/scenarios/six-position.yaml' --output=out"},
        Writer{"Convert", "convert --from=six-face --input=faces --output=out/recording"}),
    [](const auto& test) { return test.param.name; });

// A converter that is a program of its own.
struct Converted {
  std::string format;
  std::string prepare;  // writes `log` below the folder $folder; run in the folder of the sources
  std::string flags;

  friend std::ostream& operator<<(std::ostream& out, const Converted& converted) {
    return out << converted.format;
  }
};

class KilledConverter : public ::testing::TestWithParam<Converted> {
 protected:
  void SetUp() override {
    const std::string program = "truetriad-convert-" + GetParam().format;
    if (!fs::exists(fs::path(TRUETRIAD_BINARY).parent_path() / program)) {
      GTEST_SKIP() << program << " was not built";
    }
    const Finished made =
        RunShell("export folder='" + folder_.Path(".") + "'; " + GetParam().prepare);
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  std::string Line() const {
    return std::string(kProgram) + " convert --from=" + GetParam().format +
           " --input=log --output=out " + GetParam().flags;
  }

  const TemporaryFolder folder_;
};

TEST_P(KilledConverter, LeavesAWholeRecordingOrNoneAndTheNextRunNoLitter) {
  const int kills = IsNightly() ? 40 : 7;
  // Who dies: truetriad and what it started; what it started, which it must say; truetriad alone.
  const std::string look = "read -r c </proc/$p/task/$p/children; ";
  const std::string ways[] = {"{ " + look + "kill -KILL $p $c; } 2>/dev/null",
                              // Waits for it a moment, as it would seldom be met.
                              "{ for i in $(seq 2000); do " + look +
                                  "[ -n \"$c\" ] && break; done; kill -KILL $c; } 2>/dev/null",
                              "kill -KILL $p 2>/dev/null"};
  Moments moments(SecondsOf([&] { ASSERT_EQ(RunShell(Line(), folder_.Path(".")).exit_code, 0); }),
                  11);
  const std::map<std::string, std::string> whole = FilesIn(folder_.Path("out"));
  ASSERT_TRUE(whole.contains("recording.yaml"));
  const Patience patience;
  int killed = 0, said = 0;
  for (int i = 0; (killed < kills || said == 0) && patience.Lasts(); ++i) {
    const bool onto_nothing = i % 2 == 0;
    if (onto_nothing) {
      fs::remove_all(folder_.Path("out"));
    } else if (!fs::exists(folder_.Path("out"))) {
      ASSERT_EQ(RunShell(Line(), folder_.Path(".")).exit_code, 0);
    }
    const Finished run = RunKilled(Line(), ways[i % 3], moments.Next(), folder_.Path("."));
    const bool is_there = fs::exists(folder_.Path("out"));
    EXPECT_TRUE(is_there || (onto_nothing && run.exit_code != 0));
    if (is_there) {
      EXPECT_EQ(FilesIn(folder_.Path("out")), whole) << i;
    }
    killed += run.exit_code == 0 ? 0 : 1;
    moments.Learn(run.exit_code != 0);
    if (i % 3 != 1 || run.exit_code == 0) continue;
    ++said;
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_THAT(run.err, HasSubstr("was stopped by signal 9; its output is either complete or"));
  }
  EXPECT_GE(killed, kills);
  EXPECT_GT(said, 0);
  ASSERT_EQ(RunShell(Line(), folder_.Path(".")).exit_code, 0);
  EXPECT_EQ(FilesIn(folder_.Path("out")), whole);
  // One that lost its parent may end a moment later, and what is its own is left until then.
  while (!LitterIn(folder_.Path(".")).empty() && patience.Lasts()) {
    ASSERT_EQ(RunShell(Line(), folder_.Path(".")).exit_code, 0);
  }
  EXPECT_THAT(LitterIn(folder_.Path(".")), IsEmpty());
}

constexpr char kOfDriver[] =
    "--units=us,counts,rad/s --columns=accelerometer=/driver:low.acc@t_us,"
    "gyroscope=/driver:gx+gy+gz@t_us";

INSTANTIATE_TEST_SUITE_P(
    Each,
    KilledConverter,
    ::testing::Values(
        Converted{"dataflash", "tools/bench/make_log.py dataflash-2014 $folder/log 20000", ""},
        Converted{"vectornav",
                  "tools/bench/make_log.py vectornav $folder/log 20000",
                  "--columns=time=100Hz"},
        Converted{"ros1", "tests/convert/bags.py ros1 $folder/log 0 20000", kOfDriver},
        Converted{"ros2-db3",
                  "tests/convert/bags.py ros2-db3 $folder/log 0 10000; "
                  "tests/convert/bags.py layout $folder/Reading.msg",
                  std::string(kOfDriver) + " --layout=Reading.msg"},
        Converted{"mcap", "tests/convert/bags.py mcap $folder/log 0 5000", kOfDriver},
        Converted{
            "ulog",
            "cd tests/convert_node; python3 -c 'import os, writers; "
            "open(os.environ[\"folder\"] + \"/log\", \"wb\").write(writers.appended_ulog()[0])'",
            ""},
        Converted{"parquet", "cp tests/convert_node/table.parquet $folder/log", ""},
        Converted{"json",
                  "python3 -c 'import json; print(json.dumps({\"acc\": [[i, 2, 3] for i in "
                  "range(20000)]}))' > $folder/log",
                  "--units=g --columns=accelerometer=acc@100Hz"},
        Converted{"mat",
                  "\"$(dirname '" TRUETRIAD_BINARY
                  "')\"/tests/convert/truetriad_make_mat 5z $folder/log 20000",
                  "--units=s,m/s^2 --columns=accelerometer=imu.acc@t"},
        Converted{
            "gnss-ins-sim",
            "mkdir $folder/log; cd $folder/log; (echo 'time (sec)'; seq 0 0.01 200) > time.csv; "
            "(echo 'accel_x (m/s^2),accel_y (m/s^2),accel_z (m/s^2)'; seq -f '%g,1,2' 0 20000) "
            "> accel-0.csv",
            ""}),
    [](const auto& test) {
      std::string name = test.param.format;
      std::erase(name, '-');
      return name;
    });

TEST(TwoWriters, OfOneFolderLeaveAWholeResult) {
  const TemporaryFolder folder;
  folder.Write("log.csv", LogText({.rests = 16}));
  for (int i = 0; i < 10; ++i) {
    const std::string one = std::string(kProgram) + " calibrate log.csv -o out --quiet";
    const Finished run =
        RunShell(one + " & " + one + " ; status=$?; wait $! && exit $status", folder.Path("."));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(ReadCalibration(folder.Path("out/calibration.yaml")));
    EXPECT_THAT(TemporaryFolder::Read(folder.Path("out/report.html")), HasSubstr("</html>"));
    EXPECT_THAT(LitterIn(folder.Path("out")), IsEmpty());
  }
}

TEST(ShellLimits, OfFilesAndMemoryAreErrorsThatLeaveNothing) {
  const TemporaryFolder folder;
  folder.Write("log.csv", LogText({.rests = 16}));
  const std::string line = std::string(kProgram) + " calibrate log.csv -o out";
  const Finished large = RunShell("ulimit -f 8; " + line, folder.Path("."));
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_THAT(large.err, HasSubstr("cannot be written"));
  EXPECT_THAT(LitterIn(folder.Path(".")), IsEmpty());
  EXPECT_FALSE(fs::exists(folder.Path("out/calibration.yaml")));
  for (int megabytes = 50; megabytes < 80; megabytes += 2) {
    fs::remove_all(folder.Path("out"));
    const Finished poor =
        RunShell("ulimit -v " + std::to_string(1000 * megabytes) + "; " + line, folder.Path("."));
    if (poor.exit_code == 0) break;
    if (poor.exit_code == 127) continue;  // Not even its libraries have room.
    EXPECT_EQ(poor.exit_code, 2) << megabytes << " MB: " << poor.err;
    EXPECT_THAT(poor.err, HasSubstr("memory is short")) << megabytes << " MB";
    EXPECT_FALSE(fs::exists(folder.Path("out/calibration.yaml")));
  }
}

TEST(FullDisk, LeavesWhatWasThere) {
  const TemporaryFolder folder;
  folder.Write("log.csv", LogText({.rests = 16}));
  fs::create_directory(folder.Path("disk"));
  const std::string disk = folder.Path("disk");
  if (RunShell("mount -t tmpfs -o size=4m tmpfs '" + disk + "'").exit_code != 0) {
    GTEST_SKIP() << "mounting a file system is not allowed here";
  }
  const std::string calibrate =
      std::string(kProgram) + " calibrate log.csv -o disk/out --overwrite";
  EXPECT_EQ(RunShell(calibrate, folder.Path(".")).exit_code, 0);
  const std::map<std::string, std::string> before = FilesIn(disk + "/out");
  RunShell("cat /dev/zero > '" + disk + "/ballast'");
  const Finished full = RunShell(calibrate, folder.Path("."));
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("No space left on device"));
  EXPECT_EQ(FilesIn(disk + "/out"), before);
  EXPECT_THAT(LitterIn(disk), IsEmpty());
  const Finished simulated =
      RunShell(std::string(kProgram) + " simulate -c '" TRUETRIAD_SOURCE_DIR
                                       "/configs/scenarios/consumer-9dof.yaml' -o disk/simulated",
               folder.Path("."));
  EXPECT_EQ(simulated.exit_code, 2) << simulated.err;
  EXPECT_FALSE(fs::exists(disk + "/simulated/recording.csv"));
  RunShell("umount '" + disk + "'");
}

TEST(ClosedStdout, IsSaid) {
  const Finished run = RunShell(std::string(kProgram) + " version >&-");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("stdout"));
}

}  // namespace interrupted_test
}  // namespace truetriad
