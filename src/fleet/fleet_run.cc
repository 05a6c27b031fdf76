// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <chrono>
#include <utility>

#include <sys/stat.h>

#include "truetriad/base/version.h"

namespace truetriad::fleet {
namespace {

/// The runs of a store by log, as far as they are of this experiment and program.
class Known {
 public:
  static Result<Known> Of(Store& store, const std::string& config_sha256) {
    Known known;
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<KnownRun> runs, store.LastRuns());
    for (KnownRun& run : runs) {
      if (run.config_sha256 != config_sha256 || run.software_version != Version()) continue;
      std::string log = run.log;
      known.runs_.emplace(std::move(log), std::move(run));
    }
    return known;
  }

  /// The log has not been touched since its run.
  bool Has(const std::string& log) const {
    const auto found = runs_.find(log);
    struct stat about {};
    if (found == runs_.end() || stat(log.c_str(), &about) != 0) return false;
    const KnownRun& run = found->second;
    return run.log_bytes == about.st_size &&
           run.log_modified_ns ==
               std::int64_t{about.st_mtim.tv_sec} * 1'000'000'000 + about.st_mtim.tv_nsec;
  }

 private:
  std::map<std::string, KnownRun> runs_;
};

}  // namespace

Result<FleetProgress> RunFleet(
    const std::vector<UnitOrder>& units,
    const FleetOptions& options,
    Store& store,
    const std::function<void(const UnitRun&, const FleetProgress&)>& on_run,
    const std::function<bool()>& is_stopped) {
  constexpr double kLookS = 0.2;
  const auto begin = std::chrono::steady_clock::now();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string config_sha256, ConfigSha256(options.plan));
  FleetProgress progress;
  std::vector<const UnitOrder*> wanted;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Known known,
      options.resumes ? Known::Of(store, config_sha256) : Result<Known>(Known()));
  for (const UnitOrder& unit : units) {
    if (options.resumes && known.Has(unit.log)) {
      ++progress.skipped;
    } else {
      wanted.push_back(&unit);
    }
  }
  progress.units = wanted.size();
  WorkerPool workers(options.worker_command, options.plan, options.jobs, options.limits);
  std::size_t next = 0;
  while (workers.IsBusy() || (next < wanted.size() && !is_stopped())) {
    while (next < wanted.size() && workers.HasFree() && !is_stopped()) {
      TRUETRIAD_RETURN_IF_ERROR(workers.Give(*wanted[next++]));
    }
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<UnitRun> runs, workers.Wait(kLookS));
    // First something to do for those that are free, then what they have done.
    for (std::size_t i = 0; i < runs.size() && next < wanted.size() && !is_stopped(); ++i) {
      if (!workers.HasFree()) break;
      TRUETRIAD_RETURN_IF_ERROR(workers.Give(*wanted[next++]));
    }
    for (UnitRun& run : runs) {
      run.config_sha256 = config_sha256;
      TRUETRIAD_RETURN_IF_ERROR(store.Add(run));
      ++progress.done;
      ++progress.verdicts[run.verdict];
      progress.cpu_s += run.cpu_s;
      if (IsRed(run.verdict)) {
        ++progress.red;
        ++progress.codes[run.code];
      }
      progress.seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (on_run) on_run(run, progress);
    }
  }
  progress.is_stopped = next < wanted.size();
  progress.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return progress;
}

}  // namespace truetriad::fleet
