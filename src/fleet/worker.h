// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <vector>

#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// What a unit may take.
struct UnitLimits {
  double seconds = 120.0;
  std::int64_t bytes = std::int64_t{2} << 30;  ///< Of address space of its process.
};

/// Processes that calibrate a unit each. One that dies of it, takes too long over it or needs too
/// much memory costs that unit's run, which says so. They end with this process, however that ends,
/// and not by signals that are meant for it. While one is started this process has one thread.
class WorkerPool {
 public:
  WorkerPool(const WorkPlan& plan, std::size_t size, UnitLimits limits);
  ~WorkerPool();  ///< Kills those that are at work.
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  bool HasFree() const { return workers_.size() < size_; }
  bool IsBusy() const { return !workers_.empty(); }
  /// Starts a process for a unit. Error (bad input): none can be started.
  Status Give(const UnitOrder& order);
  /// Runs that have ended, after at most `seconds` of waiting for one; a signal ends the wait.
  std::vector<UnitRun> Wait(double seconds);

 private:
  struct Worker;

  /// The run of a worker that has ended.
  UnitRun RunOfEnded(const Worker& worker) const;
  UnitRun RunWithout(const Worker& worker, const char* code, std::string message) const;

  const WorkPlan& plan_;
  std::size_t size_;
  UnitLimits limits_;
  std::list<Worker> workers_;
};

}  // namespace truetriad::fleet
