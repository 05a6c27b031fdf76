// SPDX-License-Identifier: Apache-2.0
// The whole process group of a fleet dies at some moment, again and again.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "math/random.h"
#include "support/log_writer.h"
#include "support/nightly.h"

namespace truetriad {
namespace fleet_killed_test {

namespace fs = std::filesystem;

class KilledFleet : public ::testing::Test {
 protected:
  void WriteUnits(int count) const {
    fs::create_directories(folder_.Path("line"));
    for (int i = 0; i < count; ++i) {
      LogOptions options{.rests = 12, .magnetometer = false};
      options.seed = static_cast<std::uint64_t>(i + 1);
      folder_.Write("line/u" + std::to_string(1000 + i) + ".csv", LogText(options));
    }
  }
  /// Calibrates them into `output`; returns how long it took, s.
  double Run(const std::string& output, const std::string& before = "") const {
    const auto begin = std::chrono::steady_clock::now();
    last_ = RunShell(before + " '" TRUETRIAD_BINARY "' fleet run line --report=false --jobs=2 " +
                         "--resume --quiet -o " + output,
                     folder_.Path(""));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  std::string Ask(const std::string& sql, const std::string& output) const {
    const Finished run = RunShell(
        "'" TRUETRIAD_BINARY "' fleet query --csv --store=" + output + "/fleet.db \"" + sql + "\"",
        folder_.Path(""));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.out;
  }
  /// Folders of runs, and what is in them that no run has put there for good.
  std::pair<int, std::vector<std::string>> FoldersAndLitter(const std::string& output) const {
    int folders = 0;
    std::vector<std::string> litter;
    const std::string units = folder_.Path(output + "/units");
    for (const fs::directory_entry& unit : fs::directory_iterator(units)) {
      if (!unit.is_directory()) continue;
      for (const fs::directory_entry& run : fs::directory_iterator(unit.path())) {
        ++folders;
        for (const fs::directory_entry& file : fs::directory_iterator(run.path())) {
          const std::string name = file.path().filename().string();
          if (name.starts_with('.') || name.find(".tmp-") != std::string::npos) {
            litter.push_back(file.path().string());
          }
        }
      }
    }
    return {folders, litter};
  }

  const TemporaryFolder folder_;
  mutable Finished last_;
};

TEST_F(KilledFleet, IsResumedToTheStoreOfOneThatWasNot) {
  const int units = IsNightly() ? 300 : 40;
  const int kills = IsNightly() ? 50 : 6;
  WriteUnits(units);
  const double whole_s = Run("whole");
  ASSERT_EQ(last_.exit_code, 0) << last_.err;
  double start_s = Run("whole");  // Nothing to do.
  // So that the last finds something to do, too.
  double share_s = 2.0 * std::max(0.0, whole_s - start_s) / kills;
  Random random(18);
  const Patience patience;
  int killed = 0;
  while (killed < kills && patience.Lasts()) {
    char moment[32];
    std::snprintf(moment, sizeof moment, "%.4f", start_s + share_s * random.Uniform());
    Run("cut", std::string("timeout -s KILL ") + moment);
    killed += last_.exit_code == 0 ? 0 : 1;
    if (last_.exit_code != 0) continue;
    // The machine has become quicker: from the beginning.
    fs::remove_all(folder_.Path("cut"));
    share_s *= 0.5;
    start_s *= 0.9;
  }
  EXPECT_EQ(killed, kills);
  // One that was killed holds its folder until the kernel has done with it.
  Run("cut", "flock cut/units/.lock true; flock cut/.lock true;");
  ASSERT_EQ(last_.exit_code, 0) << last_.err;
  const std::string parameters =
      "SELECT serial, verdict, code, place, name, value, sigma FROM run JOIN parameter USING (run) "
      "ORDER BY serial, place";
  EXPECT_EQ(Ask(parameters, "cut"), Ask(parameters, "whole"));
  const std::string covariances = "SELECT serial, hex(covariance) FROM run ORDER BY serial";
  EXPECT_EQ(Ask(covariances, "cut"), Ask(covariances, "whole"));
  const std::string counts =
      "SELECT count(*), count(DISTINCT serial), count(DISTINCT log) FROM run";
  const std::string number = std::to_string(units);
  EXPECT_THAT(Ask(counts, "cut"), ::testing::HasSubstr(number + "," + number + "," + number));
  const auto [folders, litter] = FoldersAndLitter("cut");
  EXPECT_EQ(folders, units);
  EXPECT_THAT(litter, ::testing::IsEmpty());
}

}  // namespace fleet_killed_test
}  // namespace truetriad
