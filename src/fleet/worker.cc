// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <sstream>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fleet/database.h"
#include "fleet/log_files.h"
#include "fleet/unit_work.h"
#include "io/input_guard.h"

namespace truetriad::fleet {
namespace {

using Clock = std::chrono::steady_clock;

bool WriteAll(int stream, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = send(stream, text.data(), text.size(), MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// A line without its newline; unset: the stream has ended.
std::optional<std::string> NextLine(std::FILE* file) {
  char* text = nullptr;
  std::size_t size = 0;
  const ssize_t count = getline(&text, &size, file);
  const std::unique_ptr<char, void (*)(void*)> owner(text, std::free);
  if (count <= 0 || text[count - 1] != '\n') return std::nullopt;
  return std::string(text, static_cast<std::size_t>(count - 1));
}

/// For tests: TRUETRIAD_FLEET_FAULT=crash:PART makes the worker crash at a unit whose log's name
/// contains PART. In place of crash: hang, memory, or grow (to half of the memory limit). Commas
/// separate several faults.
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
    if (fault.starts_with("grow")) {
      rlimit limit{};
      getrlimit(RLIMIT_AS, &limit);
      mmap(nullptr, limit.rlim_cur / 2, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    }
  }
}

/// Whether the other end of the stream is closed, even if data are left to read.
bool IsAbandoned(int stream) {
  pollfd end{stream, 0, 0};
  return poll(&end, 1, 0) > 0 && (end.revents & (POLLHUP | POLLERR)) != 0;
}

std::string HowEnded(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return std::string("was ended by signal ") + std::to_string(signal) + " (" + strsignal(signal) +
           (signal == SIGKILL ? "; perhaps memory ran out)" : ")");
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

int ServeAsWorker(int stream) {
  // The worker dies with its parent, and ignores signals meant for the parent.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // If the parent has already ended, it may have left orders, but nobody reads their results.
  if (IsAbandoned(stream)) return 0;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  std::FILE* const file = fdopen(stream, "r");
  if (file == nullptr) return static_cast<int>(ErrorKind::kBadInput);
  const std::optional<std::string> first = NextLine(file);
  if (!first) return 0;
  const Result<WorkPlan> plan = ReadPlan(*first);
  if (!plan) return static_cast<int>(plan.error().kind());
  const auto bytes = static_cast<rlim_t>(plan->memory_bytes);
  const rlimit limit{bytes, bytes};
  if (bytes > 0) setrlimit(RLIMIT_AS, &limit);
  while (const std::optional<std::string> line = NextLine(file)) {
    const Result<UnitOrder> order = ReadOrder(*line);
    if (!order) return static_cast<int>(order.error().kind());
    const InputGuard guard;
    InputGuard::Add(order->log);
    const UnitRun run = Work(*plan, *order, FailOnPurpose);
    if (!WriteAll(stream, LineOf(run))) return 0;
  }
  return 0;
}

struct WorkerPool::Worker {
  pid_t process = 0;  ///< 0: not started.
  int stream = -1;
  std::string text;  ///< Incomplete line that was read.
  std::optional<UnitOrder> order;
  std::optional<LogStamp> stamp;  ///< State of the order's log when the worker got it.
  int units = 0;                  ///< Number of finished units.
  Clock::time_point since;
};

WorkerPool::WorkerPool(std::vector<std::string> command,
                       const WorkPlan& plan,
                       int size,
                       UnitLimits limits)
    : command_(std::move(command)), plan_(plan), limits_(limits) {
  plan_.memory_bytes = limits.bytes;
  for (int i = 0; i < size; ++i) workers_.push_back(std::make_unique<Worker>());
}

WorkerPool::~WorkerPool() {
  for (const auto& worker : workers_) End(worker.get());
}

bool WorkerPool::HasFree() const {
  return std::ranges::any_of(workers_, [](const auto& worker) { return !worker->order; });
}

bool WorkerPool::IsBusy() const {
  return std::ranges::any_of(workers_,
                             [](const auto& worker) { return worker->order.has_value(); });
}

Status WorkerPool::Start(Worker* worker) {
  const auto failed = [](const std::string& what) {
    return Error(ErrorCode::kSystemFailure, "no worker can be started: " + what);
  };
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return failed(std::strerror(errno));
  }
  std::vector<char*> words;
  for (std::string& word : command_) words.push_back(word.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  posix_spawn_file_actions_addopen(&streams, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  // Output of libraries to stdout must not mix with results.
  posix_spawn_file_actions_adddup2(&streams, STDERR_FILENO, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&streams, ends[1], kStream);
  const int failure =
      posix_spawn(&worker->process, words[0], &streams, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&streams);
  close(ends[1]);
  worker->stream = ends[0];
  worker->text.clear();
  if (failure != 0) {
    worker->process = 0;
    End(worker);
    return failed(command_[0] + ": " + std::strerror(failure));
  }
  if (!WriteAll(worker->stream, LineOf(plan_))) {
    End(worker);
    return failed("its process ends at once");
  }
  return {};
}

void WorkerPool::End(Worker* worker) {
  if (worker->stream >= 0) close(worker->stream);
  if (worker->process > 0) {
    if (worker->order) kill(worker->process, SIGKILL);  // An idle worker ends by itself.
    while (waitpid(worker->process, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  *worker = Worker();
}

Status WorkerPool::Give(UnitOrder order) {
  order.run = last_run_ = NewRunIdAfter(last_run_);
  for (const auto& worker : workers_) {
    if (worker->order) continue;
    // A worker that has died meanwhile is replaced once.
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (worker->process == 0) TRUETRIAD_RETURN_IF_ERROR(Start(worker.get()));
      if (WriteAll(worker->stream, LineOf(order))) break;
      End(worker.get());
    }
    if (worker->process == 0)
      return Error(ErrorCode::kSystemFailure, "worker processes end at once");
    worker->order = std::move(order);
    worker->stamp = StampOf(worker->order->log);
    worker->since = Clock::now();
    return {};
  }
  return Error(ErrorCode::kSystemFailure, "all workers are busy");
}

bool WorkerPool::HasGrown(const Worker& worker) const {
  // During its first units every worker grows, so its memory is not checked yet.
  constexpr int kFewUnits = 10;
  if (worker.process == 0 || worker.units < kFewUnits) return false;
  std::ifstream statm("/proc/" + std::to_string(worker.process) + "/statm");
  std::int64_t pages = 0;
  statm >> pages;
  return 2 * pages * sysconf(_SC_PAGESIZE) > limits_.bytes;
}

UnitRun WorkerPool::RunWithout(const Worker& worker, const char* code, std::string message) const {
  UnitRun run = RunOf(plan_, *worker.order);
  // The run states the log as it was when the worker got the unit. If the log changed later, it
  // will be calibrated again.
  if (worker.stamp) run.log_bytes = worker.stamp->bytes;
  if (worker.stamp) run.log_modified_ns = worker.stamp->modified_ns;
  run.code = code;
  run.message = worker.order->log + ": " + std::move(message);
  run.wall_s = std::chrono::duration<double>(Clock::now() - worker.since).count();
  return run;
}

Result<std::optional<UnitRun>> WorkerPool::Take(Worker* worker) {
  std::array<char, 65536> part{};
  const ssize_t count = recv(worker->stream, part.data(), part.size(), MSG_DONTWAIT);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::optional<UnitRun>();
  if (count > 0) {
    worker->text.append(part.data(), static_cast<std::size_t>(count));
    const std::size_t end = worker->text.find('\n');
    if (end == std::string::npos) return std::optional<UnitRun>();
    TRUETRIAD_ASSIGN_OR_RETURN(UnitRun run,
                               ReadLine(std::string_view(worker->text).substr(0, end)));
    worker->text.clear();
    worker->order.reset();
    ++worker->units;
    return std::optional(std::move(run));
  }
  int status = 0;
  while (waitpid(worker->process, &status, 0) < 0 && errno == EINTR) {
  }
  worker->process = 0;
  std::optional<UnitRun> run;
  if (worker->order) run = RunWithout(*worker, kCrashed, "the worker " + HowEnded(status));
  End(worker);
  return run;
}

Result<std::vector<UnitRun>> WorkerPool::Wait(double seconds) {
  std::vector<pollfd> streams;
  std::vector<Worker*> waited;
  const Clock::time_point now = Clock::now();
  for (const auto& worker : workers_) {
    if (!worker->order) continue;
    streams.push_back({worker->stream, POLLIN, 0});
    waited.push_back(worker.get());
    const double used = std::chrono::duration<double>(now - worker->since).count();
    seconds = std::min(seconds, std::max(0.0, limits_.seconds - used));
  }
  std::vector<UnitRun> runs;
  poll(streams.data(), streams.size(), static_cast<int>(1e3 * seconds) + 1);
  for (std::size_t i = 0; i < waited.size(); ++i) {
    Worker* const worker = waited[i];
    if ((streams[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
      TRUETRIAD_ASSIGN_OR_RETURN(std::optional<UnitRun> run, Take(worker));
      if (!run) continue;
      // A new process has its whole memory limit again.
      if (run->code == kMemoryLimit || HasGrown(*worker)) End(worker);
      runs.push_back(std::move(*run));
    } else if (std::chrono::duration<double>(Clock::now() - worker->since).count() >=
               limits_.seconds) {
      runs.push_back(RunWithout(
          *worker,
          kTimeLimit,
          "takes longer than " + NumberText(limits_.seconds) + " s, the time limit of a unit"));
      End(worker);
    }
  }
  return runs;
}

}  // namespace truetriad::fleet
