// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fleet/shard.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad::fleet {

/// Makes the folder of a run's files, which counts as unfinished from now on, and as one of a run
/// that goes into `store` (WorkPlan::store). Error (bad input): it cannot be made.
Status BeginFolder(const std::string& folder, const std::string& store);
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
  /// which is called `name` (WorkPlan::store), and are not there. Error (bad input): it cannot be
  /// written to.
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

}  // namespace truetriad::fleet
