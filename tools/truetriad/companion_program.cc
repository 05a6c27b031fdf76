// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/companion_program.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string_view>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/companion.h"

namespace truetriad {
namespace {

namespace fs = std::filesystem;

bool IsInPath(std::string_view program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

/// A stream of a child process, read once that has ended.
class Captured {
 public:
  int descriptor() const { return fileno(file_.get()); }
  bool usable() const { return file_ != nullptr; }
  std::string Text() const {
    std::string text;
    std::rewind(file_.get());
    std::array<char, 4096> part{};
    for (std::size_t n = 0; (n = std::fread(part.data(), 1, part.size(), file_.get())) > 0;) {
      text.append(part.data(), n);
    }
    return text;
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_{std::tmpfile()};
};

}  // namespace

Result<std::string> FindNodeProgram(const std::string& program, const std::string& flag) {
  if (!IsInPath("node")) {
    return Error(ErrorCode::kMissingProgram,
                 flag +
                     ": needs Node.js, which is not in PATH; install nodejs (and npm to set up "
                     "tools/convert-node)");
  }
  if (const std::optional<std::string> found = FindCompanion(program)) return *found;
  return Error(ErrorCode::kMissingProgram,
               flag + ": " + program +
                   " is not beside truetriad; build it with tools/build.sh programs (it needs "
                   "nodejs 18 or newer, and npm)");
}

Result<ProgramRun> RunProgram(const std::string& program,
                              const std::vector<std::string>& arguments,
                              bool captures) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  std::fflush(stdout);
  std::optional<Captured> out, err;
  if (captures) {
    out.emplace();
    err.emplace();
    if (!out->usable() || !err->usable()) {
      return Error(ErrorCode::kSystemFailure,
                   std::string("no temporary file: ") + std::strerror(errno));
    }
  }
  const int out_to = out ? out->descriptor() : STDOUT_FILENO;
  const int err_to = err ? err->descriptor() : STDERR_FILENO;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    return Error(ErrorCode::kSystemFailure,
                 {program},
                 std::string("cannot be started: ") + std::strerror(errno));
  }
  constexpr int kCannotStart = 127;
  if (child == 0) {
    // A program for which nobody waits must not write into a folder that somebody else has now.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent || dup2(out_to, STDOUT_FILENO) < 0 || dup2(err_to, STDERR_FILENO) < 0) {
      _exit(kCannotStart);
    }
    execv(program.c_str(), pointers.data());
    _exit(kCannotStart);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return Error(ErrorCode::kSystemFailure, {program}, std::strerror(errno));
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == kCannotStart) {
    return Error(ErrorCode::kSystemFailure, {program}, "cannot be started");
  }
  if (WIFEXITED(status)) {
    return ProgramRun{WEXITSTATUS(status), out ? out->Text() : "", err ? err->Text() : ""};
  }
  return Error(ErrorCode::kDamagedFile,
               program + " was stopped by signal " + std::to_string(WTERMSIG(status)) +
                   "; its output is there as a whole, or not at all");
}

}  // namespace truetriad
