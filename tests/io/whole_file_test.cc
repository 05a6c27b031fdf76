// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace {

namespace fs = std::filesystem;

// Of a process that has ended and been waited for.
pid_t DeadProcess() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

TEST(WholeFile, LeavesTheOldFileUntilTheNewOneIsWhole) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("result.yaml", "old");
  {
    WholeFile file(path);
    file.Write("new");
    EXPECT_EQ(TemporaryFolder::Read(path), "old");
  }
  EXPECT_EQ(TemporaryFolder::Read(path), "old");
  WholeFile file(path);
  file.Write("new");
  ASSERT_TRUE(file.Commit());
  EXPECT_EQ(TemporaryFolder::Read(path), "new");
}

TEST(WholeFile, RemovesWhatKilledWritersLeftAndNothingElse) {
  const TemporaryFolder folder;
  const std::string dead =
      folder.Write("other.csv.tmp-" + std::to_string(DeadProcess()) + "-0", "half");
  const std::string alive =
      folder.Write("other.csv.tmp-" + std::to_string(getpid()) + "-7", "being written");
  const std::string theirs = folder.Write("notes.tmp-1x-2", "not ours");
  WholeFile file(folder.Path("result.yaml"));
  file.Write("text");
  ASSERT_TRUE(file.Commit());
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_TRUE(fs::exists(alive));
  EXPECT_TRUE(fs::exists(theirs));
}

}  // namespace
}  // namespace truetriad
