// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/node/node_log.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/companion.h"
#include "tools/convert/common/byte_stream.h"
#include "tools/convert/common/converter.h"
#include "tools/truetriad/interruption.h"

namespace truetriad::convert {
namespace {

constexpr int kScriptPipe = 3;     ///< As lib/read.js knows it.
constexpr int kCannotStart = 127;  // As a shell says it.

Error ErrorFrom(std::string_view body) {
  const Json stated = Json::parse(body, nullptr, /*allow_exceptions=*/false);
  Error error(ErrorCode::kDamagedFile, stated.value("message", ""));
  for (const ErrorInfo& info : AllErrorCodes()) {
    if (info.name == stated.value("code", "")) error.code = info.code;
  }
  return error;
}

}  // namespace

Result<std::unique_ptr<NodeLog>> NodeLog::Start(const Json& request) {
  const std::optional<std::string> script = FindCompanion("../lib/read.js");
  int ends[2] = {-1, -1};
  if (!script) return Error(ErrorCode::kBrokenInstallation, "convert-node/lib/read.js is missing");
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Error(ErrorCode::kSystemFailure, std::string("no pipe: ") + std::strerror(errno));
  std::unique_ptr<NodeLog> log(new NodeLog());
  log->pipe_ = ends[0];
  std::string text = request.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
  std::string path = *script, program = "node";
  char* const words[] = {program.data(), path.data(), text.data(), nullptr};
  std::fflush(stdout);
  const pid_t parent = getpid();
  log->child_ = fork();
  if (log->child_ == 0) {
    // Nobody reads what the script of a program that was killed finds.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == parent &&
        (ends[1] == kScriptPipe ? fcntl(ends[1], F_SETFD, 0) : dup2(ends[1], kScriptPipe)) >= 0)
      execvp(words[0], words);
    _exit(kCannotStart);
  }
  close(ends[1]);
  if (log->child_ < 0)
    return Error(ErrorCode::kSystemFailure,
                 std::string("cannot start a process: ") + std::strerror(errno));
  return log;
}

NodeLog::~NodeLog() {
  if (pipe_ >= 0) close(pipe_);
  if (child_ <= 0) return;
  kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

bool NodeLog::Fill(std::size_t count) {
  constexpr std::size_t kChunk = std::size_t{1} << 18U;  // As lib/frames.js writes.
  if (end_ - begin_ >= count) return true;
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  while (end_ < count) {
    if (buffer_.size() < end_ + kChunk) buffer_.resize(end_ + kChunk);
    pollfd wait = {pipe_, POLLIN, 0};
    if (poll(&wait, 1, -1) < 0 && errno == EINTR && !IsInterrupted()) continue;
    if (IsInterrupted()) throw Interrupted();
    const ssize_t got = read(pipe_, buffer_.data() + end_, buffer_.size() - end_);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    end_ += static_cast<std::size_t>(got);
  }
  return true;
}

Result<NodeLog::Frame> NodeLog::Next() {
  constexpr std::size_t kHead = 5;  // The letter and the length.
  for (;;) {
    const bool has_head = Fill(kHead);
    const std::size_t size =
        has_head ? LoadNumber<std::uint32_t>({buffer_.data() + begin_, kHead}, 1) : 0;
    if (!has_head || !Fill(kHead + size)) break;
    const Frame frame = {buffer_[begin_], {buffer_.data() + begin_ + kHead, size}};
    begin_ += kHead + size;
    if (frame.kind == 'X') return Frame{};
    if (frame.kind == 'E') return ErrorFrom(frame.body);
    if (frame.kind == 'N') {
      Note(std::string(frame.body));
    } else if (frame.kind == 'O') {
      std::fwrite(frame.body.data(), 1, frame.body.size(), stdout);
    } else {
      return frame;
    }
  }
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
  child_ = -1;
  if (IsInterrupted()) throw Interrupted();
  if (WIFEXITED(status) && WEXITSTATUS(status) == kCannotStart)
    return Error(ErrorCode::kMissingProgram, "needs Node.js, which is not in PATH; install nodejs");
  return Error(ErrorCode::kDamagedFile, "the log is damaged; its reader crashed on it");
}

}  // namespace truetriad::convert
