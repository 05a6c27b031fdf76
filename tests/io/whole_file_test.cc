// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace whole_file_test {

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

TEST(WholeFiles, GetTheirNamesTogetherOrNotAtAll) {
  const TemporaryFolder folder;
  const std::string first = folder.Write("a", "old"), second = folder.Path("b");
  fs::create_directory(second);
  {
    WholeFiles files;
    EXPECT_TRUE(files.Write(first, "new"));
    EXPECT_EQ(files.Write(second, "new").error().code, ErrorCode::kOutputInTheWay);
  }
  EXPECT_EQ(TemporaryFolder::Read(first), "old");
  fs::remove(second);
  WholeFiles files;
  EXPECT_TRUE(files.Write(first, "new"));
  EXPECT_TRUE(files.Write(second, "new"));
  EXPECT_FALSE(fs::exists(second));
  ASSERT_TRUE(files.Commit());
  EXPECT_EQ(TemporaryFolder::Read(first) + TemporaryFolder::Read(second), "newnew");
}

TEST(WholeFile, RemovesWhatKilledWritersLeftAndNothingElse) {
  const TemporaryFolder folder;
  // "…/other.csv.tmp-", the machine, the process, a number.
  const TemporaryFolder elsewhere;  // A folder is looked through once.
  const std::string name = TemporaryNameBeside(elsewhere.Path("other.csv"));
  const std::string ours = "-" + std::to_string(getpid()) + "-";
  const std::string machine = name.substr(0, name.rfind(ours));
  const std::string left = "-" + std::to_string(DeadProcess()) + "-";
  const auto write = [&](const std::string& path) {
    return folder.Write(fs::path(path).filename().string(), "half");
  };
  const std::string dead = write(machine + left + "0");
  const std::string dead_folder =
      folder.Path("simulated.tmp-") + machine.substr(machine.rfind("-") + 1) + left + "0";
  fs::create_directory(dead_folder);
  const std::string alive = write(machine + ours + "7");
  const std::string theirs = write("notes.tmp-1x-2");
  const std::string of_another_machine = write(machine + "1" + left + "0");
  WholeFile file(folder.Path("result.yaml"));
  file.Write("text");
  ASSERT_TRUE(file.Commit());
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_FALSE(fs::exists(dead_folder));
  EXPECT_TRUE(fs::exists(of_another_machine));
  EXPECT_TRUE(fs::exists(alive));
  EXPECT_TRUE(fs::exists(theirs));
}

}  // namespace whole_file_test
}  // namespace truetriad
