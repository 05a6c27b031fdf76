// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fleet/shard.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The last run that was made of a log, by which another is known to be the same.
struct KnownRun {
  std::string log;
  std::int64_t log_bytes = 0, log_modified_ns = 0;
  std::string config_sha256, software_version;
  Verdict verdict = Verdict::kBadInput;
};

/// Rows of a question, as text; NULL is an unset value.
struct Table {
  std::vector<std::string> columns;
  std::vector<bool> are_numbers;  ///< By column: every value is one.
  std::vector<std::vector<std::optional<std::string>>> rows;
};

/// Of how many shards the runs of a store are part.
struct StatedShards {
  int count = 0;            ///< 0: nobody has said it.
  std::optional<int> only;  ///< All runs are of this one.
};

/// Which runs.
struct RunSelection {
  bool only_standing = false;  ///< Of each unit the run that counts.
  std::string where;           ///< A condition in SQL on `run` or `standing`; empty: any.
};

/// Where runs are kept. A run is added once and never changed. All functions: an error (bad input)
/// where the store cannot be reached or written.
class Store {
 public:
  virtual ~Store() = default;

  /// On the disk when it returns. A run that is there already is not added again.
  virtual Status Add(const UnitRun& run) = 0;
  /// The same of several, faster where a store can write them at once.
  virtual Status AddAll(std::span<const UnitRun> runs);
  /// Of each log the last run.
  virtual Result<std::vector<KnownRun>> LastRuns() = 0;
  /// Of which shard further runs are; the first who says how many there are, states it. Error
  /// (usage): another number was stated, or the store is of another shard.
  virtual Status StateShard(const Shard& shard) = 0;
  virtual Result<StatedShards> Shards();
  /// Answers a statement that only reads. Error (usage): it is none.
  virtual Result<Table> Query(const std::string& sql) = 0;
  /// `take`s whole runs, one after the other, in the order of their serials and then names; memory
  /// does not grow with their number. Errors also: those of `take`; (usage) a condition that is
  /// none.
  virtual Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take);
};

/// Opens a store, or makes it: PATH, sqlite:PATH, NAME.jsonl, jsonl:PATH. Error (bad input): it is
/// none of this program's, of a newer version of it, or on a file system that SQLite cannot lock.
/// Error (usage): another kind of URL.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// The same of one that is there; nothing can be written to it, nor, while an InputGuard lives, be
/// put in its place.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

/// The file of a store that is one; unset: it is kept by a server.
std::optional<std::string> FileOfStore(const std::string& url);

}  // namespace truetriad::fleet
