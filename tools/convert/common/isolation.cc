// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/common/isolation.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tools/convert/common/converter.h"
#include "tools/truetriad/interruption.h"

namespace truetriad::convert {
namespace {

constexpr int kInterrupted = 120;

/// Bounded by what a file of this size can sensibly hold.
void BoundMemory([[maybe_unused]] const std::string& path) {
#ifndef __SANITIZE_ADDRESS__  // Which maps terabytes.
  constexpr rlim_t kLeast = rlim_t{2} << 30U;
  constexpr rlim_t kPerByte = 64;
  std::error_code ignored;
  const rlim_t size = std::filesystem::file_size(path, ignored);
  const rlim_t bytes = ignored ? kLeast : kLeast + kPerByte * size;
  const rlimit limit = {bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
#endif
}

int Work(const std::function<Status()>& work) {
  try {
    const Status status = work();
    if (!status) {
      Note(status.error().message);
      return static_cast<int>(status.error().kind());
    }
  } catch (const Interrupted&) {
    return kInterrupted;
  } catch (const std::exception& failure) {
    Note(failure.what());
    return static_cast<int>(ErrorKind::kBadInput);
  }
  return std::fflush(stdout) == 0 ? 0 : static_cast<int>(ErrorKind::kBadInput);
}

}  // namespace

Status Isolated(const std::string& path, const std::function<Status()>& work) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child < 0)
    return Error(ErrorCode::kSystemFailure,
                 std::string("cannot start a process: ") + std::strerror(errno));
  if (child == 0) {
    BoundMemory(path);
    _exit(Work(work));  // What the parent holds is the parent's to clear away.
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return Error(ErrorCode::kSystemFailure, std::strerror(errno));
  }
  if (!WIFEXITED(status)) {
    return Error(ErrorCode::kDamagedFile,
                 {path},
                 "is damaged; the reader crashed on it (signal " +
                     std::to_string(WTERMSIG(status)) + "); nothing was written");
  }
  if (WEXITSTATUS(status) == kInterrupted) throw Interrupted();
  if (WEXITSTATUS(status) == 0) return {};
  // The child has said why.
  return Error{static_cast<ErrorCode>(WEXITSTATUS(status)), ""};
}

}  // namespace truetriad::convert
