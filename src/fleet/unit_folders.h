// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fleet/store.h"
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad::fleet {

/// Creates the folder of a run's files. A mark in the folder states that the folder is unfinished,
/// and to which `store` the run will be added (WorkPlan::StoreMark). Error (bad input): it cannot
/// be created.
Status BeginFolder(const std::string& folder, const std::string& store);
/// Removes the folder and its files; the mark of an unfinished folder is removed last. So if the
/// removal is interrupted, the folder still counts as unfinished.
void RemoveFolder(const std::string& folder);
/// Removes the mark, once the run is in the store. Does nothing if `folder` is empty.
void FinishFolder(const std::string& folder);
/// Writes all files of a run's result into its folder, or none: calibration.json, calibration.yaml
/// and the report, if it is set. Error (bad input): a file cannot be written.
Status WriteResult(const std::string& folder,
                   const Calibration& calibration,
                   const std::optional<std::string>& report);
/// Renames a run's folder to the `name` of the run. Does nothing if `folder` is empty. Error (bad
/// input): it cannot be renamed.
Status RenameFolder(const std::string& name, std::string* folder);

/// A lock on a folder, released with the object or the process.
class FolderClaim {
 public:
  /// Shares `units`, the folder of units' folders, with other processes. If no other process uses
  /// `units`, unfinished folders are removed first if their run was meant for `store` (`name` is
  /// its WorkPlan::StoreMark) but is not in it. Only folders of units that have changed since the
  /// last such search are examined. Error (bad input): `units` cannot be written to.
  static Result<FolderClaim> Share(const std::string& units, Store& store, const std::string& name);
  /// Locks `folder`, or one shard's part of it, exclusively for a process that skips finished
  /// units: two such processes would calibrate the same units. Error (bad input): another process
  /// has this lock.
  static Result<FolderClaim> TakeAlone(const std::string& folder, const Shard& shard = {});

  /// Waits for the lock on `folder`, whose files several processes may change. If locking is not
  /// possible, the claim holds nothing.
  static FolderClaim WaitFor(const std::string& folder);

  ~FolderClaim();
  FolderClaim(FolderClaim&& other) noexcept;
  FolderClaim& operator=(FolderClaim&&) = delete;

 private:
  explicit FolderClaim(int file) : file_(file) {}

  int file_;  ///< The locked file.
};

/// A run whose files could not be changed.
struct Unreached {
  Error error;
  bool is_there = false;  ///< The run's folder exists.
};

/// The result of making the files of a unit's runs agree with the store.
struct Agreement {
  std::string why;                     ///< "its current run X is FAIL"; empty: deliverable.
  std::vector<std::string> withdrawn;  ///< New names of withdrawn exports (WithdrawExports).
  std::vector<Unreached> unreached;    ///< Runs whose files could not be changed.

  /// Whether the unit may not be delivered, but some of its calibrations do not state this.
  bool IsUnsafe() const { return !why.empty() && !unreached.empty(); }
  /// Sentences for the user.
  std::vector<std::string> Notes(const std::string& serial) const;
};

/// Makes the calibration files of a unit's runs state the store's decisions: those of all runs
/// state a refusal, those of the current run a concession. If the current run is not good, the
/// files of the other runs state that the unit may not be delivered. Exports that contradict this
/// are withdrawn. The call may be repeated, also by several processes at once. FolderOf finds the
/// folders. Does nothing for a file of runs, which has no standings. Error (bad input): the store
/// cannot be queried.
Result<Agreement> AgreeFolders(Store& store,
                               const std::string& serial,
                               const std::filesystem::path& units);

/// The present folder of a run whose files were written to `folder`. It is the first that exists of
/// SERIAL/RUN below `units`, which may have been moved or copied with its store; `folder` itself;
/// and `folder` relative to the parent of `units`. If none exists or `units` is empty: `folder`
/// itself.
std::string FolderOf(const std::string& folder, const std::filesystem::path& units);

/// What a store states about a run: its unit's standing, whether the run is current, and the
/// decisions that its files must state.
struct HeldByStore {
  Standing unit;
  bool counts = false;
  std::vector<Decision> decisions;
};
/// Asks the store beside the units about the run of `folder`; unset: no such store has the run. The
/// files may lack a decision that was made while they could not be reached, and may have a decision
/// that only another store knows. A refusal by the store or the files holds. Without a refusal, the
/// last decision holds if the run is current.
std::optional<HeldByStore> WhatStoreHolds(const std::filesystem::path& folder,
                                          const Calibration& calibration);

/// The folder of units' folders beside the file of a store; empty: a server keeps the store.
std::filesystem::path UnitsBeside(const std::string& store_url);

}  // namespace truetriad::fleet
