// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// What has been brought together.
struct Collected {
  std::size_t runs = 0;   ///< In all sources.
  std::size_t added = 0;  ///< Of them those that the store did not have.
  int shards = 1;
  std::vector<int> missing;  ///< Shards that neither a source nor the store is of, nor any run.
  /// Units that may leave with the readings of another that may, in words: `fleet run` sees those
  /// of its own store alone.
  std::vector<std::string> copies;
  std::vector<std::string> unfinished;  ///< Sources that more may come of, or was cut off.
  std::vector<std::string> notes;       ///< Of Agreement, of units that may not leave.
  std::vector<std::string> unsafe;      ///< Of them those that are Agreement::IsUnsafe.
};

/// Adds all that is in `sources`, stores of any kind, to the store `target`: runs, decisions,
/// checks of stations, and which run of a unit counts. What is there, by its name, stays as it is,
/// so that it may be done again. Files of units beside `target` then agree with it (AgreeFolders).
/// Where a source is spoilt, nothing of any is added. Errors (bad input): a source cannot be read,
/// has what no run can be, with file and line, or is not finished (Store::CheckEnd), unless
/// `takes_unfinished`; a run of one name has another content. (Usage): sources or store are of
/// different numbers of shards, or count runs by different policies; a source is the store; the
/// store is JSON lines, which cannot tell its runs.
Result<Collected> Collect(const std::vector<std::string>& sources,
                          const std::string& target,
                          bool takes_unfinished = false);

}  // namespace truetriad::fleet
