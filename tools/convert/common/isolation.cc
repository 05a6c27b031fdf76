// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>

#include "tools/convert/common/converter.h"

#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tools/truetriad/interruption.h"

namespace truetriad::convert {
namespace {

constexpr int kInterrupted = 120;  // Beside the codes of errors, and below those of shells.

/// Bounded by what files of this size can sensibly hold.
void BoundMemory([[maybe_unused]] const std::vector<std::string>& paths) {
#ifndef __SANITIZE_ADDRESS__  // Which maps terabytes.
  constexpr rlim_t kLeast = rlim_t{2} << 30U;
  constexpr rlim_t kPerByte = 64;
  rlim_t bytes = kLeast;
  for (const std::string& path : paths) {
    std::error_code missing;
    const rlim_t size = std::filesystem::file_size(path, missing);
    if (!missing) bytes += kPerByte * size;
  }
  const rlimit limit = {bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
#endif
}

/// Nobody waits for the child of a process that was killed.
void EndWith([[maybe_unused]] pid_t parent) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(static_cast<int>(ErrorKind::kBadInput));
#endif
}

int Work(const std::function<Status()>& work) {
  try {
    if (const Status status = work(); !status) return Report(status.error());
  } catch (const Interrupted&) {
    return kInterrupted;
  } catch (const std::exception& failure) {
    return Report(Error(ErrorCode::kDamagedFile, failure.what()));
  }
  return std::fflush(stdout) == 0 ? 0 : static_cast<int>(ErrorKind::kBadInput);
}

}  // namespace

Status Isolated(const std::vector<std::string>& paths, const std::function<Status()>& work) {
  std::fflush(stdout);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0)
    return Error(ErrorCode::kSystemFailure,
                 std::string("cannot start a process: ") + std::strerror(errno));
  if (child == 0) {
    EndWith(parent);
    BoundMemory(paths);
    _exit(Work(work));  // What the parent holds is the parent's to clear away.
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return Error(ErrorCode::kSystemFailure, std::strerror(errno));
  }
  if (!WIFEXITED(status)) {
    return Error(ErrorCode::kDamagedFile,
                 {paths.size() == 1 ? paths[0] : "one of the files"},
                 "is damaged; the reader crashed on it (signal " +
                     std::to_string(WTERMSIG(status)) + "); nothing was written");
  }
  if (WEXITSTATUS(status) == kInterrupted) throw Interrupted();
  if (WEXITSTATUS(status) == 0) return {};
  // The child has said why.
  const bool is_usage = WEXITSTATUS(status) == static_cast<int>(ErrorKind::kUsage);
  return Error(is_usage ? ErrorCode::kInvalidArgument : ErrorCode::kDamagedFile, "");
}

}  // namespace truetriad::convert
