// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Calibrates one unit after the other in this process: reads a plan and then orders, lines of
/// LineOf, from `stream` (a socket), and writes the line of each run to it, until there is no
/// order. Signals that end the parent's work are ignored: it says when. The process' exit code.
int ServeAsWorker(int stream);

/// What a unit may take.
struct UnitLimits {
  double seconds = 120.0;
  std::int64_t bytes = std::int64_t{2} << 30;  ///< Of address space of its worker.
};

/// Processes that calibrate units. One that dies of a unit, takes too long over it or needs too
/// much memory costs that unit's run, which says so; another takes its place. One that has grown to
/// half of what a unit may have is renewed.
class WorkerPool {
 public:
  /// `command`: a program and its arguments that end in ServeAsWorker(kStream).
  WorkerPool(std::vector<std::string> command, const WorkPlan& plan, int size, UnitLimits limits);
  ~WorkerPool();  ///< Kills those that are at work.
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Descriptor under which a worker finds its stream.
  static constexpr int kStream = 3;

  bool HasFree() const;
  bool IsBusy() const;
  /// Gives a unit to a free worker. Error (bad input): no process can be started.
  Status Give(UnitOrder order);
  /// Runs that have ended, after at most `seconds` of waiting for one; a signal ends the wait.
  /// Error (bad input): a worker that was given nothing cannot live.
  Result<std::vector<UnitRun>> Wait(double seconds);

 private:
  struct Worker;

  Status Start(Worker* worker);
  void End(Worker* worker);
  /// Takes what a worker has written; the run, once it is whole or the worker is dead.
  Result<std::optional<UnitRun>> Take(Worker* worker);
  bool HasGrown(const Worker& worker) const;
  UnitRun RunWithout(const Worker& worker, const char* code, std::string message) const;

  std::vector<std::string> command_;
  WorkPlan plan_;
  UnitLimits limits_;
  std::string last_run_;  ///< The name of the run that was begun last.
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace truetriad::fleet
