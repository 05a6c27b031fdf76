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

/// What the reports of a fleet share, in WorkPlan::folder.
inline constexpr std::string_view kSharedAssets = "assets";
/// The same as seen from a run's folder, SERIAL/RUN.
inline constexpr std::string_view kAssetsOfRun = "../../assets";

/// What is wanted of every unit.
struct WorkPlan {
  std::string config_path;  ///< For messages and paths in it; empty: no experiment is given.
  std::string config_text;  ///< The experiment; empty: one for what is in each log.
  std::vector<std::string> overrides;  ///< As ReadExperiment takes them.
  Tags tags;                           ///< What experiment and overrides say of every unit.
  std::vector<std::string> formats;    ///< Exports: "px4", "c-header".
  bool allows_outside_limits = false;  ///< Units outside their limits are exported, too.
  bool has_report = true;
  bool shares_assets = false;  ///< Reports link to kSharedAssets, which are in `folder`.
  std::string folder;          ///< Units' folders are made in it; empty: no files are written.
  /// Of the store that the runs go into: StoreHeader::store, and NameOfStore.
  std::string store_identity, store_name;
  std::string shard;              ///< UnitRun::shard.
  std::int64_t memory_bytes = 0;  ///< UnitLimits::bytes; 0: any.

  /// By which that store is known: a copy of a store's file has the same identity, and runs of its
  /// own.
  std::string StoreMark() const { return store_identity + ' ' + store_name; }
};

/// Writes kSharedAssets into the folder of units.
Status WriteSharedAssets(const std::string& folder);

/// One unit to be calibrated.
struct UnitOrder {
  std::string log;
  std::string serial = {};       ///< Empty: the log says it, or the name of its file is taken.
  std::string serial_from = {};  ///< "day.csv:3", "--serial=…": what states it.
  Tags tags = {};                ///< Stated for this unit alone.
  std::string recorded = {};  ///< When it was measured, as UnitRun; empty: the list does not say.
  std::string run = {};       ///< UnitRun::id, so that runs are named in the order of the list.
  bool shares_name = false;   ///< Another log's file has the same name: that is no serial number.
  /// By which shards tell units apart: where the log is in the folder or list that was named, so
  /// however that is spelled and wherever it is mounted. Not for workers.
  std::string place = {};
};

/// The serial number that the name of a log's file stands for: its folder's, of a recording.yaml.
std::string SerialOfName(const std::string& log);

/// Reads the experiment. Error (bad input, usage): as ReadExperiment, or no such format.
Result<WorkPlan> PlanWork(const std::string& config,
                          std::vector<std::string> overrides,
                          std::vector<std::string> formats);

/// What a plan says of every unit. Without an experiment, its overrides: of serial number and tags
/// whatever sensors there are. Error (bad input, usage): as ReadExperiment; without an experiment,
/// what is wrong with any sensors.
Result<Experiment> ExperimentOfAll(const WorkPlan& plan);

/// Of what a plan asks for but its tags, however it is written: two equal ones give the same
/// calibrations.
Result<std::string> ConfigSha256(const WorkPlan& plan);

/// What is known of a run before the unit is looked at: log, its size and time, serial and tags (of
/// a recording.yaml those that it states, though it be wrong), identity.
UnitRun RunOf(const WorkPlan& plan, const UnitOrder& order);

/// Calibrates one unit and writes its files; whatever becomes of it is in the run. `before` is
/// called first, as part of it.
UnitRun Work(const WorkPlan& plan,
             const UnitOrder& order,
             void (*before)(const UnitOrder& order) = nullptr);

/// `text` with %XX for each byte that is neither letter, digit nor `plain`.
std::string PercentEncoded(std::string_view text, std::string_view plain);

/// `serial` as the name of a folder: what is neither letter, digit, `-`, `_` nor an inner `.` as
/// %XX, and a long one cut, with its hash.
std::string FolderNameOf(std::string_view serial);

/// One line of JSON and back.
std::string LineOf(const WorkPlan& plan);
std::string LineOf(const UnitOrder& order);
Result<WorkPlan> ReadPlan(std::string_view line);
Result<UnitOrder> ReadOrder(std::string_view line);

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
