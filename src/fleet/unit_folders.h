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

/// Makes the folder of a run's files, which counts as unfinished from now on, and as one of a run
/// that goes into `store` (WorkPlan::StoreMark). Error (bad input): it cannot be made.
Status BeginFolder(const std::string& folder, const std::string& store);
/// Removes it with all that it has, the mark of an unfinished one last: who is killed meanwhile
/// leaves a folder that still counts as unfinished.
void RemoveFolder(const std::string& folder);
/// The run of these files is in the store. Nothing, where there are none.
void FinishFolder(const std::string& folder);
/// Writes what a run found into its folder, all or nothing: the report, where it has one,
/// calibration.json and calibration.yaml. Error (bad input): it cannot be written.
Status WriteResult(const std::string& folder,
                   const Calibration& calibration,
                   const std::optional<std::string>& report);
/// Gives a run's folder the `name` of its run. Nothing, where there is none. Error (bad input): it
/// cannot be renamed.
Status RenameFolder(const std::string& name, std::string* folder);

/// A claim to a folder, given up with the object or the process.
class FolderClaim {
 public:
  /// Shares `units`, the folder of units' folders, with others that work there. Who is alone there
  /// removes what was left unfinished since the last who was, of runs that were to go into `store`,
  /// which is called `name` (WorkPlan::StoreMark), and are not there. Error (bad input): it cannot
  /// be written to.
  static Result<FolderClaim> Share(const std::string& units, Store& store, const std::string& name);
  /// For who leaves out what is done, which two at once would do twice: `folder`, or one shard's
  /// part of it. Error (bad input): somebody else has it.
  static Result<FolderClaim> TakeAlone(const std::string& folder, const Shard& shard = {});

  /// Waits for who has `folder`, whose files several may change. Nothing, where that is not
  /// possible.
  static FolderClaim WaitFor(const std::string& folder);

  ~FolderClaim();
  FolderClaim(FolderClaim&& other) noexcept;
  FolderClaim& operator=(FolderClaim&&) = delete;

 private:
  explicit FolderClaim(int file) : file_(file) {}

  int file_;  ///< Locked.
};

/// A run whose files could not be told.
struct Unreached {
  Error error;
  bool is_there = false;  ///< Its folder is.
};

/// What was done so that the files of a unit's runs state what the store says of the unit.
struct Agreement {
  std::string why;                     ///< "run X counts, and is FAIL"; empty: it may leave.
  std::vector<std::string> withdrawn;  ///< Exports, by their new names (WithdrawExports).
  std::vector<Unreached> unreached;    ///< What could not be told.

  /// The unit may not leave, and calibrations of it say nothing of that.
  bool IsUnsafe() const { return !why.empty() && !unreached.empty(); }
  /// What somebody must know, a sentence each.
  std::vector<std::string> Notes(const std::string& serial) const;
};

/// Makes the calibration of each of a unit's runs state what the store decides about it: what a
/// person decided, of a refusal all, of a concession the run that counts; where the run that counts
/// is not good, that no other is. Exports that say otherwise are withdrawn. May be repeated, and
/// called by several at once. Folders are where FolderOf finds them. Nothing, where the store does
/// not know of standings. Error (bad input): the store cannot be asked.
Result<Agreement> AgreeFolders(Store& store,
                               const std::string& serial,
                               const std::filesystem::path& units);

/// Where the files of a run are that were written to `folder`: SERIAL/RUN below `units`, which may
/// have been moved or copied with its store, else `folder` as seen from here or from beside
/// `units`. Where nothing is there, or `units` is empty: `folder` itself.
std::string FolderOf(const std::string& folder, const std::filesystem::path& units);

/// What a store says of the unit of a run: whether that run counts, and the decisions that its
/// files are to state.
struct HeldByStore {
  Standing unit;
  bool counts = false;
  std::vector<Decision> decisions;
};
/// By the store beside the units, that has the run of `folder`; unset: there is none. The files say
/// less where they could not be reached when it was decided, and more where another store knew
/// more: what refuses the unit holds, and what a person decided last of a run that counts.
std::optional<HeldByStore> WhatStoreHolds(const std::filesystem::path& folder,
                                          const Calibration& calibration);

/// Where the folders of units are of a store that is a file; empty: it is kept by a server.
std::filesystem::path UnitsBeside(const std::string& store_url);

}  // namespace truetriad::fleet
