// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The result of Collect.
struct Collected {
  std::size_t runs = 0;   ///< Of all sources; a run in two sources counts twice.
  std::size_t added = 0;  ///< Runs that the store lacked.
  int shards = 1;
  std::vector<int> missing;  ///< Shards that have neither a source nor a run in the store.
  /// One sentence for each deliverable unit whose readings are also those of an earlier run of
  /// another unit. `fleet run` does not find them if the units are in different stores.
  std::vector<std::string> copies;
  std::vector<std::string> unfinished;  ///< Sources that are not complete.
  std::vector<std::string> notes;       ///< About limits, decisions, verdicts; Agreement::Notes.
  std::vector<std::string> unsafe;      ///< Units for which Agreement::IsUnsafe is true.
};

/// Adds the runs, decisions, checks of stations and the retest policy of `sources` (stores of any
/// kind) to the store `target`. An entry whose name `target` has already is not added again, so the
/// call may be repeated. Afterwards the files of units beside `target` are changed to agree with it
/// (AgreeFolders). All sources are examined first; if one has an error, nothing is added. Errors
/// (bad input): a source cannot be read, has an invalid run (the message names file and line), or
/// is not finished (Store::MarkEnd) and `takes_unfinished` is false; two entries of one name have
/// different contents. Errors (usage): the stores have different numbers of shards or different
/// retest policies; `target` is one of the sources, or JSON lines, which cannot be queried.
Result<Collected> Collect(const std::vector<std::string>& sources,
                          const std::string& target,
                          bool takes_unfinished = false);

}  // namespace truetriad::fleet
