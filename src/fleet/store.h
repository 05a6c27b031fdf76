// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

/// Where runs are kept. A run is added once and never changed. All functions: an error (bad input)
/// where the store cannot be reached or written.
class Store {
 public:
  virtual ~Store() = default;

  /// On the disk when it returns. A run that is there already is not added again.
  virtual Status Add(const UnitRun& run) = 0;
  /// Of each log the last run.
  virtual Result<std::vector<KnownRun>> LastRuns() = 0;
  /// Of how many shards the runs are part; the first who says it, states it. Error (usage): another
  /// number was stated.
  virtual Status StateShards(int count) = 0;
  /// Answers a statement that only reads. Error (usage): it is none.
  virtual Result<Table> Query(const std::string& sql) = 0;
};

/// Opens a store, or makes it: PATH, sqlite:PATH. Error (bad input): it is none of this program's,
/// of a newer version of it, or on a file system that SQLite cannot lock. Error (usage): another
/// kind of URL.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// The same of one that is there; nothing can be written to it.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

}  // namespace truetriad::fleet
