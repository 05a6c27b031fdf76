// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
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
  Result<bool> Has(const std::string& run) override;
  Result<std::string> LatestRun(const UnitRun& run) override;
  Result<std::vector<RunName>> RunsOfSameReadings(const UnitRun& run) override;
  Result<std::vector<KnownRun>> LastRuns() override;
  Status StateShard(const Shard& shard) override;
  Status StateRetestPolicy(const RetestPolicy& policy) override;
  Result<std::optional<RetestPolicy>> StatedRetestPolicy() override;
  Result<std::string> Identity() override;
  Result<std::optional<Standing>> StandingOf(const std::string& serial) override;
  Result<std::vector<std::string>> UnitsHeldBack() override;
  Result<std::vector<RunFolder>> FoldersOfUnit(const std::string& serial) override;
  Result<Disposition> Dispose(const Disposition& disposition) override;
  Result<std::optional<StationCheck>> AddStationCheck(const StationCheck& check) override;
  Result<std::optional<StationCheck>> LastStationCheck(const std::string& station) override;
  Result<Decisions> ReadDecisions() override;
  Status AddDecisions(const Decisions& decisions) override;
  Result<Table> Query(const std::string& sql) override { return database_->AskAsGiven(sql); }
  Status AllowTypedText() override { return database_->AllowTypedText(); }
  void TellNotes(std::function<void(const std::string&)> on_note) override {
    database_->TellNotes(std::move(on_note));
  }

 private:
  /// The rows of a run, unless it is there. In a transaction.
  Status InsertRun(const UnitRun& run);
  /// How many of them were not there. In a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// What a fact is; unset: it was not stated. In a transaction.
  Result<std::optional<std::string>> Fact(std::string_view name);
  /// What was stated; unset: nothing. In a transaction.
  Result<std::optional<RetestPolicy>> PolicyThere();
  /// Makes `id` greater than all of a table and `other`; false: it is there already. In a
  /// transaction.
  Result<bool> MakeLast(const std::string& table, const std::string& other, std::string* id);
  /// The first row of an answer.
  Result<std::vector<std::optional<std::string>>> Row(std::string_view sql,
                                                      std::span<const Value> values);

  std::unique_ptr<Database> database_;
};

}  // namespace truetriad::fleet
