// SPDX-License-Identifier: Apache-2.0
#include "fleet/worker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fleet/database.h"
#include "fleet/log_files.h"
#include "io/input_guard.h"

namespace truetriad::fleet {
namespace {

using Clock = std::chrono::steady_clock;

/// For tests: TRUETRIAD_FLEET_FAULT=crash:PART makes the worker crash at a unit whose log has PART
/// in its name; hang and memory likewise. Several with commas between them.
void FailOnPurpose(const UnitOrder& order) {
  const char* const stated = std::getenv("TRUETRIAD_FLEET_FAULT");
  if (stated == nullptr) return;
  std::istringstream faults(stated);
  for (std::string fault; std::getline(faults, fault, ',');) {
    const std::size_t colon = fault.find(':');
    if (colon == std::string::npos ||
        order.log.find(fault.substr(colon + 1)) == std::string::npos) {
      continue;
    }
    if (fault.starts_with("crash")) std::abort();
    if (fault.starts_with("hang")) {
      for (;;) pause();
    }
    if (fault.starts_with("memory")) throw std::bad_alloc();
  }
}

/// What a worker does: calibrates the unit and writes the line of its run to `stream`.
[[noreturn]] void Serve(const WorkPlan& plan,
                        const UnitOrder& order,
                        const UnitLimits& limits,
                        unsigned stream,
                        pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(0);  // It had ended before that.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  // Of the parent's files none, nor its locks; and what a library prints is no result.
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  if (stream > STDERR_FILENO + 1) close_range(STDERR_FILENO + 1, stream - 1, 0);
  close_range(stream + 1, ~0U, 0);
  const auto bytes = static_cast<rlim_t>(limits.bytes);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
  InputGuard::Add(order.log);
  const std::string line = LineOf(Work(plan, order, FailOnPurpose));
  for (std::string_view text = line; !text.empty();) {
    const ssize_t written = send(static_cast<int>(stream), text.data(), text.size(), MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  _exit(0);
}

std::string HowEnded(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return std::string("was ended by signal ") + std::to_string(signal) + " (" + strsignal(signal) +
           (signal == SIGKILL ? "; was memory short?)" : ")");
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

/// How a process ended that has, or is about to.
int StatusOf(pid_t process) {
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

double SecondsSince(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

}  // namespace

struct WorkerPool::Worker {
  UnitOrder order;
  std::optional<LogStamp> stamp;  ///< Of its log when it was given.
  Clock::time_point since = Clock::now();
  pid_t process = 0;
  int stream = -1;
  std::string text;  ///< What it has written.

  explicit Worker(const UnitOrder& of) : order(of), stamp(StampOf(of.log)) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    if (stream >= 0) close(stream);
    if (process == 0) return;
    kill(process, SIGKILL);
    StatusOf(process);
  }
};

WorkerPool::WorkerPool(const WorkPlan& plan, std::size_t size, UnitLimits limits)
    : plan_(plan), size_(size), limits_(limits) {}

WorkerPool::~WorkerPool() = default;

Status WorkerPool::Give(const UnitOrder& order) {
  const auto failed = [] {
    return Error(ErrorCode::kSystemFailure,
                 std::string("no worker can be started: ") + std::strerror(errno));
  };
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return failed();
  const pid_t parent = getpid();
  const pid_t process = fork();
  if (process == 0) Serve(plan_, order, limits_, static_cast<unsigned>(ends[1]), parent);
  const Error error = failed();
  close(ends[1]);
  if (process < 0) {
    close(ends[0]);
    return error;
  }
  Worker& worker = workers_.emplace_back(order);
  worker.process = process;
  worker.stream = ends[0];
  return {};
}

UnitRun WorkerPool::RunWithout(const Worker& worker, const char* code, std::string message) const {
  UnitRun run = RunOf(plan_, worker.order);
  // Its log as it was then: what has come since is to be calibrated, too.
  if (worker.stamp) run.log_bytes = worker.stamp->bytes;
  if (worker.stamp) run.log_modified_ns = worker.stamp->modified_ns;
  run.code = code;
  run.message = worker.order.log + ": " + std::move(message);
  run.wall_s = SecondsSince(worker.since);
  return run;
}

UnitRun WorkerPool::RunOfEnded(const Worker& worker) const {
  const int status = StatusOf(worker.process);
  if (worker.text.ends_with('\n')) {
    const std::string_view line(worker.text.data(), worker.text.size() - 1);
    if (Result<UnitRun> run = ReadLine(line)) return *std::move(run);
  }
  return RunWithout(worker, kCrashed, "the worker " + HowEnded(status));
}

std::vector<UnitRun> WorkerPool::Wait(double seconds) {
  std::vector<pollfd> streams;
  for (const Worker& worker : workers_) {
    streams.push_back({worker.stream, POLLIN, 0});
    seconds = std::min(seconds, std::max(0.0, limits_.seconds - SecondsSince(worker.since)));
  }
  std::vector<UnitRun> runs;
  poll(streams.data(), streams.size(), static_cast<int>(1e3 * seconds) + 1);
  auto stream = streams.begin();
  for (auto at = workers_.begin(); at != workers_.end(); ++stream) {
    const auto worker = at++;
    if ((stream->revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
      std::array<char, 65536> part{};
      const ssize_t count = recv(worker->stream, part.data(), part.size(), MSG_DONTWAIT);
      if (count > 0) worker->text.append(part.data(), static_cast<std::size_t>(count));
      if (count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR))) continue;
      runs.push_back(RunOfEnded(*worker));
      worker->process = 0;
    } else if (SecondsSince(worker->since) >= limits_.seconds) {
      runs.push_back(RunWithout(*worker,
                                kTimeLimit,
                                "takes longer than " + ShortestText(limits_.seconds) +
                                    " s, which is what a unit may take"));
    } else {
      continue;
    }
    workers_.erase(worker);
  }
  return runs;
}

}  // namespace truetriad::fleet
