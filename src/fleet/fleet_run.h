// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "fleet/worker.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// How a fleet is calibrated.
struct FleetOptions {
  WorkPlan plan;
  int jobs = 1;
  UnitLimits limits;
  bool resumes = false;  ///< Leaves out what has a run of the same log, experiment and program.
  std::vector<std::string> worker_command;
};

/// What has become of it so far.
struct FleetProgress {
  std::size_t units = 0;    ///< To be calibrated, without those left out.
  std::size_t skipped = 0;  ///< Left out: their run is there.
  std::size_t done = 0, red = 0;
  std::map<Verdict, std::size_t> verdicts;
  std::map<std::string, std::size_t> codes;  ///< Of red ones.
  double seconds = 0.0, cpu_s = 0.0;         ///< The workers' processor time.
  bool is_stopped = false;                   ///< Before all were done.
};

/// Calibrates `units`, each in one of `jobs` processes, and adds every run to `store` once its
/// files are on the disk. `on_run` is told of each; where `is_stopped` says so no further unit is
/// begun. Error (bad input): the store or the workers fail; what is done is in the store.
Result<FleetProgress> RunFleet(
    const std::vector<UnitOrder>& units,
    const FleetOptions& options,
    Store& store,
    const std::function<void(const UnitRun&, const FleetProgress&)>& on_run,
    const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
