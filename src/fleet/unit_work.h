// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  /// Of the store that the runs go into: Store::Identity, and NameOfStore.
  std::string store_identity, store_name;
  std::string shard;  ///< UnitRun::shard.

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

}  // namespace truetriad::fleet
