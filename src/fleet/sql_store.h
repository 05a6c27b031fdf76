// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fleet/database.h"
#include "fleet/store.h"

namespace truetriad::fleet {

/// A store in a database.
class SqlStore : public Store {
 public:
  explicit SqlStore(std::unique_ptr<Database> database) : database_(std::move(database)) {}

  Status Add(const UnitRun& run) override { return AddAll({&run, 1}); }
  Status AddAll(std::span<const UnitRun> runs) override;
  Result<std::vector<KnownRun>> LastRuns() override;
  Status StateShard(const Shard& shard) override;
  Status StateRetestPolicy(const RetestPolicy& policy) override;
  Result<std::optional<Standing>> StandingOf(const std::string& serial) override;
  Result<std::string> Dispose(const Disposition& disposition) override;
  Status AddStationCheck(const StationCheck& check) override;
  Result<std::optional<StationCheck>> LastStationCheck(const std::string& station) override;
  Status AddDecisions(Store& from) override;
  Result<Table> Query(const std::string& sql) override { return database_->AskAsGiven(sql); }

 private:
  /// The rows of a run, unless it is there. In a transaction.
  Status InsertRun(const UnitRun& run);
  /// How many of them were not there. In a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// What a fact is; unset: it was not stated. In a transaction.
  Result<std::optional<std::string>> Fact(std::string_view name);

  std::unique_ptr<Database> database_;
};

}  // namespace truetriad::fleet
