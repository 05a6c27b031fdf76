// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/unit_run.h"
#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/model/tags.h"

namespace truetriad::fleet {

/// The folder in WorkPlan::folder with the files that all reports share.
inline constexpr std::string_view kSharedAssets = "assets";
/// The path of that folder from a run's folder, SERIAL/RUN.
inline constexpr std::string_view kAssetsOfRun = "../../assets";

/// The calibration that every unit gets.
struct WorkPlan {
  std::string config_path;  ///< For messages and relative paths; empty: no experiment is given.
  std::string config_text;  ///< The experiment; empty: one that fits the contents of each log.
  std::vector<std::string> overrides;  ///< As for ReadExperiment.
  Tags tags;                           ///< Tags of every unit, from experiment and overrides.
  std::vector<std::string> formats;    ///< Exports: "px4", "c-header".
  bool allows_outside_limits = false;  ///< Exports units outside their limits, too.
  bool has_report = true;
  bool shares_assets = false;  ///< Reports link to kSharedAssets, which are in `folder`.
  std::string folder;          ///< Parent of the units' folders; empty: no files are written.
  /// StoreHeader::store and NameOfStore of the store to which the runs are added.
  std::string store_identity, store_name;
  std::string shard;              ///< UnitRun::shard.
  std::int64_t memory_bytes = 0;  ///< UnitLimits::bytes; 0: no limit.

  /// Identifies that store by identity and name, since a copy of a store's file has the same
  /// store_identity but its own runs.
  std::string StoreMark() const { return store_identity + ' ' + store_name; }
};

/// Writes kSharedAssets into the folder of units.
Status WriteSharedAssets(const std::string& folder);

/// One unit to be calibrated.
struct UnitOrder {
  std::string log;
  std::string serial = {};       ///< Empty: as the log states it, or else its file name.
  std::string serial_from = {};  ///< Source of `serial`: "day.csv:3", "--serial=…".
  Tags tags = {};                ///< Stated for this unit alone.
  std::string recorded = {};     ///< Time of measurement by a list; empty: not listed.
  std::string run = {};          ///< UnitRun::id; later units get greater ones.
  bool shares_name = false;  ///< Another log has this file name, so the name is no serial number.
  /// The path of the log relative to the folder or list that the user named. Shards are assigned by
  /// this path, since it does not depend on spelling or mount point. It is not sent to workers.
  std::string place = {};
};

/// The serial number that the name of a log's file implies; for a recording.yaml its folder's name.
std::string SerialOfName(const std::string& log);

/// Reads the experiment. Error (bad input, usage): as ReadExperiment, or an unknown format.
Result<WorkPlan> PlanWork(const std::string& config,
                          std::vector<std::string> overrides,
                          std::vector<std::string> formats);

/// The plan's settings for every unit. If it has no experiment, these are the overrides (serial
/// number, tags), read with the first set of sensors for which they are valid. Error (bad input,
/// usage): as ReadExperiment; without an experiment, if the overrides are valid for no set.
Result<Experiment> ExperimentOfAll(const WorkPlan& plan);

/// Digest of a plan without its tags and the spelling of its experiment. Plans with equal digests
/// calibrate a log equally.
Result<std::string> ConfigSha256(const WorkPlan& plan);

/// The data of a run that are known before calibration: id, log with size and time, serial number,
/// tags and shard. A serial number or tag that the order and the plan do not state is taken from a
/// recording.yaml that states it, even if this file has errors.
UnitRun RunOf(const WorkPlan& plan, const UnitOrder& order);

/// Calibrates one unit and writes its files; the run states any failure. `before` is called first;
/// if it fails, the unit fails.
UnitRun Work(const WorkPlan& plan,
             const UnitOrder& order,
             void (*before)(const UnitOrder& order) = nullptr);

/// `text` with %XX for each byte that is neither a letter, a digit nor in `plain`.
std::string PercentEncoded(std::string_view text, std::string_view plain);

/// `serial` as a folder name: bytes other than letters, digits, `-`, `_` and inner `.` become %XX,
/// and a long name is cut and gets its hash.
std::string FolderNameOf(std::string_view serial);

/// A plan or order as one line of JSON, and functions that read such a line.
std::string LineOf(const WorkPlan& plan);
std::string LineOf(const UnitOrder& order);
Result<WorkPlan> ReadPlan(std::string_view line);
Result<UnitOrder> ReadOrder(std::string_view line);

/// Calibrates units one after another in this process: reads a plan and then orders, lines of
/// LineOf, from `stream` (a socket), and writes a line for each run to it, until the orders end.
/// Signals to stop are ignored, since the parent decides. Returns the exit code of the process.
int ServeAsWorker(int stream);

/// Resource limits of one unit.
struct UnitLimits {
  double seconds = 120.0;
  std::int64_t bytes = std::int64_t{2} << 30;  ///< Address space of its worker.
};

/// A pool of worker processes. If a unit crashes its worker or exceeds its time or memory, its run
/// states this, and the worker is replaced. If a worker has grown to half of a unit's memory limit,
/// it is replaced, too.
class WorkerPool {
 public:
  /// `command`: a program with arguments that calls ServeAsWorker(kStream).
  WorkerPool(std::vector<std::string> command, const WorkPlan& plan, int size, UnitLimits limits);
  ~WorkerPool();  ///< Kills busy workers.
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// File descriptor of a worker's stream.
  static constexpr int kStream = 3;

  bool HasFree() const;
  bool IsBusy() const;
  /// Gives a unit to a free worker. Error (bad input): no process can be started.
  Status Give(UnitOrder order);
  /// Returns runs that have ended, after waiting at most `seconds`; a signal ends the wait. Error
  /// (bad input): a worker's output is not a run.
  Result<std::vector<UnitRun>> Wait(double seconds);

 private:
  struct Worker;

  Status Start(Worker* worker);
  void End(Worker* worker);
  /// Reads a worker's output; returns the run when it is complete or the worker is dead.
  Result<std::optional<UnitRun>> Take(Worker* worker);
  bool HasGrown(const Worker& worker) const;
  UnitRun RunWithout(const Worker& worker, const char* code, std::string message) const;

  std::vector<std::string> command_;
  WorkPlan plan_;
  UnitLimits limits_;
  std::string last_run_;  ///< The name of the run started last.
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace truetriad::fleet
