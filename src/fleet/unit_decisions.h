// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

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
/// is not good, that no other is. Exports that say otherwise are withdrawn. Changes nothing where
/// all is said, so may be repeated, and be called by several at once. Folders are where FolderOf
/// finds them. Nothing, where the store does not know of standings. Error (bad input): the store
/// cannot be asked.
Result<Agreement> AgreeFolders(Store& store,
                               const std::string& serial,
                               const std::filesystem::path& units);

/// Where the files of a run are that were written to `folder`: SERIAL/RUN below `units`, which may
/// have been moved or copied with its store, else `folder` as seen from here or from beside
/// `units`. Where nothing is there, or `units` is empty: `folder` itself.
std::string FolderOf(const std::string& folder, const std::filesystem::path& units);

/// Where the folders of units are of a store that is a file; empty: it is kept by a server.
std::filesystem::path UnitsBeside(const std::string& store_url);

}  // namespace truetriad::fleet
