// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/fleet_run.h"
#include "fleet/log_files.h"
#include "io/temporary_folder.h"
#include "support/patience.h"

namespace truetriad::fleet {
namespace log_watch_test {

namespace fs = std::filesystem;

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr char kRecording[] =
    "recording: 1\napplied: none\nstreams:\n"
    "  accelerometer: { file: imu.csv, time: { column: t, unit: s }, x: x, y: y, z: z, "
    "unit: m/s^2 }\n"
    "  magnetometer: { file: mag.csv, time: { column: t, unit: s }, x: x, y: y, z: z, unit: uT }\n";

class Watch : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(Path("")); }
  std::string Path(const std::string& name) const {
    const std::string path = (fs::path(folder_.Path("line")) / name).string();
    return name.empty() ? folder_.Path("line") : path;
  }
  void Write(const std::string& name, const std::string& text = "time[s]\n") const {
    fs::create_directories(fs::path(Path(name)).parent_path());
    folder_.Write("line/" + name, text);
  }
  void Open(WatchOptions options = {}) {
    options.folder = Path("");
    options.look_s = 0.2;
    Result<std::unique_ptr<OrderSource>> watch =
        OpenLogWatch(options, {}, [this](const std::string& note) { notes_.push_back(note); });
    ASSERT_TRUE(watch) << watch.error().message;
    watch_ = std::move(*watch);
  }
  /// What is given within some time, as seen from the folder, and done with; so many are waited
  /// for.
  std::vector<std::string> Given(double seconds, std::size_t least = 0) {
    std::vector<std::string> given;
    const Patience patience;
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    do {
      EXPECT_TRUE(watch_->Look());
      while (std::optional<Arrival> arrival = watch_->Next()) {
        given.push_back(
            fs::path(arrival->order.log).lexically_relative(Path("")).lexically_normal().string());
        UnitRun run;
        run.log = arrival->order.log;
        const LogStamp stamp = StampOf(run.log).value_or(LogStamp());
        run.log_bytes = stamp.bytes;
        run.log_modified_ns = stamp.modified_ns;
        watch_->Finish(run);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    } while (std::chrono::steady_clock::now() < end || (given.size() < least && patience.Lasts()));
    return given;
  }

  const TemporaryFolder folder_;
  std::vector<std::string> notes_;
  std::unique_ptr<OrderSource> watch_;
};
// Until a look has found something twice.
constexpr double kTwoLooksS = 0.9;

TEST_F(Watch, GivesATableOnceNobodyWritesToIt) {
  Open();
  std::ofstream open_file(Path("a.csv"));
  open_file << "time[s]\n" << std::flush;
  std::ofstream hidden(Path(".b.part"));
  hidden << "time[s]\n";
  hidden.close();
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  open_file.close();
  EXPECT_THAT(Given(0.0, 1), ElementsAre("a.csv"));
  fs::rename(Path(".b.part"), Path("b.csv"));
  EXPECT_THAT(Given(0.0, 1), ElementsAre("b.csv"));
  Write("c.txt");
  Write(".d.csv");
  Write("e.csv.tmp-1-2-0");
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(Watch, GivesALogAgainOnlyIfItHasChanged) {
  Open();
  Write("a.csv");
  EXPECT_THAT(Given(0.0, 1), ElementsAre("a.csv"));
  std::ofstream(Path("a.csv"), std::ios::app);  // Opened and closed.
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  Write("a.csv", "time[s]\n0\n");
  EXPECT_THAT(Given(0.0, 1), ElementsAre("a.csv"));
}

TEST_F(Watch, GivesFirstWhatIsThereAndNotWhatSomebodyStillWrites) {
  Write("a.csv");
  Write("deep/er/b.csv");
  Write("x.csv.truetriad/no.csv");
  std::ofstream open_file(Path("c.csv"));
  open_file << "time[s]\n" << std::flush;
  Open();
  EXPECT_THAT(Given(kTwoLooksS, 2), UnorderedElementsAre("a.csv", "deep/er/b.csv"));
  open_file.close();
  EXPECT_THAT(Given(0.0, 1), ElementsAre("c.csv"));
}

TEST_F(Watch, LooksIntoFoldersThatAreMadeOrRenamedIn) {
  Open();
  Write("new/a.csv");
  fs::create_directories(folder_.Path("elsewhere/deep"));
  folder_.Write("elsewhere/deep/b.csv", "time[s]\n");
  fs::rename(folder_.Path("elsewhere"), Path("moved"));
  EXPECT_THAT(Given(kTwoLooksS, 2), UnorderedElementsAre("new/a.csv", "moved/deep/b.csv"));
  Write("new/c.csv");
  EXPECT_THAT(Given(0.0, 1), ElementsAre("new/c.csv"));
  fs::rename(Path("new"), Path("newer"));
  EXPECT_THAT(Given(kTwoLooksS, 2), UnorderedElementsAre("newer/a.csv", "newer/c.csv"));
}

TEST_F(Watch, GivesARecordingOnceAllItsTablesAreThere) {
  Open();
  Write("unit/imu.csv");
  EXPECT_THAT(Given(0.1), IsEmpty());
  Write("unit/recording.yaml", kRecording);
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  std::ofstream open_file(Path("unit/mag.csv"));
  open_file << "t,x,y,z\n" << std::flush;
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  open_file.close();
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
  Write("unit/mag.csv", "t,x,y,z\n0,1,2,3\n");
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
}

// Who waits for nothing more says what is missing; it would be lost otherwise.
TEST_F(Watch, GivesAnIncompleteRecordingAsItIsWhenItEnds) {
  Write("unit/imu.csv");
  Write("unit/recording.yaml", kRecording);
  Write("late.csv");
  std::ofstream open_file(Path("late.csv"), std::ios::app);
  const auto begin = std::chrono::steady_clock::now();
  Open({.until_idle_s = 1.5});
  EXPECT_TRUE(watch_->Look());
  EXPECT_FALSE(watch_->HasEnded());
  EXPECT_THAT(watch_->Left(),
              ElementsAre(HasSubstr("late.csv is not calibrated: another program is still writing"),
                          HasSubstr("recording.yaml is not calibrated: it names files")));
  EXPECT_THAT(Given(0.0, 1), ElementsAre("unit/recording.yaml"));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1500));
  const Patience patience;
  while (!watch_->HasEnded() && patience.Lasts()) EXPECT_THAT(Given(0.0), IsEmpty());
  EXPECT_TRUE(watch_->HasEnded());
  Write("unit/mag.csv");
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
}

// On a machine that lets it wait there may be no look for long.
TEST_F(Watch, DoesNotEndBeforeItHasGivenWhatIsThere) {
  Write("a.csv");
  Open({.until_idle_s = 0.1});
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_FALSE(watch_->HasEnded());
  EXPECT_TRUE(watch_->Look());
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_FALSE(watch_->HasEnded());
  EXPECT_THAT(Given(0.0, 1), ElementsAre("a.csv"));
}

TEST_F(Watch, GivesARecordingAgainWhenAnyOfItsTablesChanges) {
  fs::create_directories(Path("raw"));
  std::string manifest = kRecording;
  manifest.replace(manifest.find("mag.csv"), 7, "../raw/mag.csv");
  Write("unit/recording.yaml", manifest);
  Write("unit/imu.csv");
  Write("raw/mag.csv");
  Open();
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
  // As long as it was, and older.
  const fs::file_time_type before = fs::last_write_time(Path("raw/mag.csv"));
  Write("raw/mag.csv", "time[s]X");
  fs::last_write_time(Path("raw/mag.csv"), before - std::chrono::hours(1));
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
  Write("unit/beside.csv", "time[s],accel_x[m/s^2]\n0,1\n");
  Write("unit/attitudes.csv", "time[s],qw,qx,qy,qz\n0,1,0,0,0\n");
  Write("unit/deep/below.CSV");
  EXPECT_THAT(Given(kTwoLooksS, 2), UnorderedElementsAre("unit/beside.csv", "unit/deep/below.CSV"));
}

// Its file of poses belongs to a recording, too.
TEST_F(Watch, GivesARecordingAgainWhenItsPosesChange) {
  Write("unit/poses.yaml", "poses: [ { first: 0, last: 1 } ]\n");
  Write("unit/recording.yaml", std::string(kRecording) + "poses: { file: poses.yaml }\n");
  Write("unit/imu.csv");
  Write("unit/mag.csv");
  Open();
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
  Write("unit/poses.yaml", "poses: [ { first: 0, last: 2 } ]\n");
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("unit/recording.yaml"));
}

TEST_F(Watch, FollowsLinksToFolders) {
  Write("there/u0.csv");
  fs::create_directories(folder_.Path("elsewhere"));
  folder_.Write("elsewhere/u1.csv", "time[s]\n");
  Open();
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("there/u0.csv"));
  fs::create_directory_symlink(folder_.Path("elsewhere"), Path("link"));
  fs::create_directory_symlink(Path(""), Path("loop"));
  EXPECT_THAT(Given(kTwoLooksS, 1), ElementsAre("link/u1.csv"));
  folder_.Write("elsewhere/u2.csv", "time[s]\n");
  EXPECT_THAT(Given(0.0, 1), ElementsAre("link/u2.csv"));
}

TEST_F(Watch, WaitsForItsFolderToComeBack) {
  Open();
  fs::rename(Path(""), folder_.Path("away"));
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("cannot be read")));
  fs::rename(folder_.Path("away"), Path(""));
  Write("b.csv");
  EXPECT_THAT(Given(0.0, 1), ElementsAre("b.csv"));
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("cannot be read"), HasSubstr("can be read again")));
}

TEST_F(Watch, RefusesALogThatIsNotNamedAsStated) {
  Open({.serial_pattern = "U{serial}.csv"});
  Write("U7.csv");
  Write("V8.csv");
  std::optional<Arrival> one, other;
  for (const Patience patience; !other && patience.Lasts();) {
    ASSERT_TRUE(watch_->Look());
    std::optional<Arrival>& next = one ? other : one;
    next = watch_->Next();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->order.serial, "7");
  EXPECT_FALSE(one->refusal);
  ASSERT_TRUE(other->refusal);
  EXPECT_EQ(other->refusal->code, ErrorCode::kDoesNotMatch);
}

TEST_F(Watch, LeavesOutItsOwnResults) {
  fs::create_directories(Path("out/units"));
  Open({.without = Path("out/units")});
  Write("out/units/U1/x.csv");
  EXPECT_THAT(Given(kTwoLooksS), IsEmpty());
}

}  // namespace log_watch_test
}  // namespace truetriad::fleet
