// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The result of Collect.
struct Collected {
  std::size_t runs = 0;   ///< In all sources.
  std::size_t added = 0;  ///< Runs that the store lacked.
  int shards = 1;
  std::vector<int> missing;  ///< Shards with neither a source nor a run in the store.
  /// Sentences about two units that may both be delivered although they have the same readings:
  /// `fleet run` compares units only within its own store.
  std::vector<std::string> copies;
  std::vector<std::string> unfinished;  ///< Sources that are not complete.
  std::vector<std::string> notes;       ///< Agreement::Notes, on units that may not be delivered.
  std::vector<std::string> unsafe;      ///< Units for which Agreement::IsUnsafe.
};

/// Adds the contents of `sources`, stores of any kind, to the store `target`: runs, decisions,
/// checks of stations, and the retest policy. An entry of a name that the store has is not added
/// again, so the call may be repeated. Afterwards the files of units beside `target` are made to
/// agree (AgreeFolders). If a source has an error, nothing of any source is added. Errors (bad
/// input): a source cannot be read, has an invalid run (file and line are named) or is not finished
/// (Store::MarkEnd), unless `takes_unfinished`; two runs of one name have different contents.
/// (Usage): sources or store have different numbers of shards or retest policies; a source is the
/// store; the store is JSON lines, which cannot look up its runs.
Result<Collected> Collect(const std::vector<std::string>& sources,
                          const std::string& target,
                          bool takes_unfinished = false);

}  // namespace truetriad::fleet
