// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Makes the folder of a run's files, which counts as unfinished from now on. Error (bad input): it
/// cannot be made.
Status BeginFolder(const std::string& folder);
/// The run of these files is in the store. Nothing, where there are none.
void FinishFolder(const std::string& folder);

/// A claim to a folder, given up with the object or the process.
class FolderClaim {
 public:
  /// Shares `units`, the folder of units' folders, with others that work there. Who is alone there
  /// removes what was left unfinished, and has no run in the store, since the last who was. Error
  /// (bad input): it cannot be written to.
  static Result<FolderClaim> Share(const std::string& units, Store& store);
  /// Error (bad input): somebody else has `folder` for himself, who says that he is `what`.
  static Result<FolderClaim> TakeAlone(const std::string& folder, const std::string& what);

  ~FolderClaim();
  FolderClaim(FolderClaim&& other) noexcept;
  FolderClaim& operator=(FolderClaim&&) = delete;

 private:
  explicit FolderClaim(int file) : file_(file) {}

  int file_;  ///< Locked.
};

}  // namespace truetriad::fleet
