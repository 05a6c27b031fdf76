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

/// Creates the folder of a run's files, marked as unfinished and with the `store` that the run goes
/// into (WorkPlan::StoreMark). Error (bad input): it cannot be created.
Status BeginFolder(const std::string& folder, const std::string& store);
/// Removes the folder and its files, the mark of an unfinished folder last, so that an interrupted
/// removal leaves a folder that still counts as unfinished.
void RemoveFolder(const std::string& folder);
/// Removes the mark once the run is in the store. Does nothing without a folder.
void FinishFolder(const std::string& folder);
/// Writes a run's result into its folder, all or nothing: the report, if any, calibration.json and
/// calibration.yaml. Error (bad input): it cannot be written.
Status WriteResult(const std::string& folder,
                   const Calibration& calibration,
                   const std::optional<std::string>& report);
/// Renames a run's folder to the `name` of the run. Does nothing without a folder. Error (bad
/// input): it cannot be renamed.
Status RenameFolder(const std::string& name, std::string* folder);

/// A lock on a folder, released with the object or the process.
class FolderClaim {
 public:
  /// Shares `units`, the folder of units' folders, with other processes. A process that is alone
  /// there first removes the unfinished folders, if changed since the last time, of runs for
  /// `store` (named `name`, WorkPlan::StoreMark) that the store lacks. Error (bad input): it cannot
  /// be written to.
  static Result<FolderClaim> Share(const std::string& units, Store& store, const std::string& name);
  /// Exclusive lock for a process that skips finished units, since two at once would do them twice:
  /// on `folder`, or one shard's part of it. Error (bad input): another process has it.
  static Result<FolderClaim> TakeAlone(const std::string& folder, const Shard& shard = {});

  /// Waits for the lock on `folder`, whose files several processes may change. Holds nothing if
  /// locking is not possible.
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
  bool is_there = false;  ///< Its folder exists.
};

/// The result of making the files of a unit's runs agree with the store.
struct Agreement {
  std::string why;                     ///< "run X counts, and is FAIL"; empty: it may be delivered.
  std::vector<std::string> withdrawn;  ///< Exports, by their new names (WithdrawExports).
  std::vector<Unreached> unreached;    ///< Runs whose files still differ.

  /// The unit may not be delivered, but some of its calibrations do not state this.
  bool IsUnsafe() const { return !why.empty() && !unreached.empty(); }
  /// Sentences for the user.
  std::vector<std::string> Notes(const std::string& serial) const;
};

/// Makes the calibration of each of a unit's runs state the store's decisions: a refusal in all of
/// them, a concession in the current run; if the current run is not good, the others state that the
/// unit is not good. Exports that disagree are withdrawn. May be repeated, also by several
/// processes at once. Folders are found by FolderOf. Does nothing if the store knows no standings.
/// Error (bad input): the store cannot be queried.
Result<Agreement> AgreeFolders(Store& store,
                               const std::string& serial,
                               const std::filesystem::path& units);

/// The present folder of a run whose files were written to `folder`: SERIAL/RUN below `units`,
/// which may have been moved or copied with its store, else `folder` relative to the working
/// directory or to the parent of `units`. If nothing exists there, or `units` is empty: `folder`
/// itself.
std::string FolderOf(const std::string& folder, const std::filesystem::path& units);

/// The store's standing of a run's unit: whether that run counts, and the decisions that its files
/// must state.
struct HeldByStore {
  Standing unit;
  bool counts = false;
  std::vector<Decision> decisions;
};
/// From the store beside the units that has the run of `folder`; unset: there is none. The files
/// may lack a decision if they could not be reached when it was made, and may have one that only
/// another store knows: then a refusal of the unit holds, and for a run that counts the last
/// decision.
std::optional<HeldByStore> WhatStoreHolds(const std::filesystem::path& folder,
                                          const Calibration& calibration);

/// The folder of units' folders of a store that is a file; empty: a server keeps the store.
std::filesystem::path UnitsBeside(const std::string& store_url);

}  // namespace truetriad::fleet
