// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fleet/rows.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A connection to a database that has the tables of schema.h: what SQLite and PostgreSQL do each
/// in its way. All functions: an error (bad input) where it cannot be reached, read or written.
class Database {
 public:
  virtual ~Database() = default;

  /// For messages, without secrets.
  virtual const std::string& name() const = 0;
  /// How many rows one statement is to insert.
  virtual std::size_t rows_at_once() const = 0;

  /// Does all of `work` or nothing of it; on the disk when it returns. `work` may be called several
  /// times: a connection that is lost is opened anew. Not to be nested.
  virtual Status Transact(Access access, const std::function<Status()>& work) = 0;
  /// How many rows a statement has inserted. In `work`.
  virtual Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) = 0;
  /// What a statement says. In `work`.
  virtual Result<Table> Ask(std::string_view sql, std::span<const Value> values) = 0;
  /// What a statement of somebody else says. Not in `work`. Error (usage): it is not understood,
  /// not one, or would change something.
  virtual Result<Table> AskAsGiven(const std::string& sql) = 0;
  /// Store::AllowTypedText. Not in `work`.
  virtual Status AllowTypedText() { return {}; }
  /// Store::TellNotes.
  virtual void TellNotes(std::function<void(const std::string&)> /*on_note*/) {}
};

/// A store in a database.
class SqlStore : public Store {
 public:
  /// Error (bad input): the tables are of another version.
  static Result<std::unique_ptr<Store>> Open(std::unique_ptr<Database> database);

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
  Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take) override;
  Result<Table> Query(const std::string& sql) override { return database_->AskAsGiven(sql); }
  Status AllowTypedText() override { return database_->AllowTypedText(); }
  void TellNotes(std::function<void(const std::string&)> on_note) override {
    database_->TellNotes(std::move(on_note));
  }

 private:
  explicit SqlStore(std::unique_ptr<Database> database) : database_(std::move(database)) {}
  /// The rows of a run, unless it is there. In a transaction.
  Status InsertRun(const UnitRun& run);
  /// How many of them were not there. In a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// Makes `id` greater than all of a table and `other`; false: it is there already. In a
  /// transaction.
  Result<bool> MakeLast(const std::string& table, const std::string& other, std::string* id);
  /// The first row of an answer; empty: there is none. In a transaction.
  Result<std::vector<Cell>> Row(std::string_view sql, std::span<const Value> values);
  /// What a statement says, in a transaction of its own.
  Result<Table> Asked(std::string_view sql, std::span<const Value> values);

  std::unique_ptr<Database> database_;
};

struct PostgresModule;

/// Those of `names` that the store has, whole.
Result<std::vector<UnitRun>> ReadNamedRuns(Store& store, const std::vector<std::string>& names);

/// A store in one file, write-ahead log and `synchronous=FULL`. Errors as OpenStore.
Result<std::unique_ptr<Store>> OpenSqlite(const std::string& path, Access access);

/// "NFS" of statfs' `f_type`: a file system on which SQLite's locks do not hold. Else empty.
std::string_view NetworkFileSystemName(long magic);

/// A store on a PostgreSQL server, in the schema where its connection makes tables. A connection
/// that is lost later on is opened anew, and what it was about repeated, for as many seconds as the
/// environment variable TRUETRIAD_STORE_PATIENCE says, 60 if it does not. Errors as OpenStore.
Result<std::unique_ptr<Store>> OpenPostgres(const std::string& url, Access access);

/// The same, through `module`, which outlives the store.
Result<std::unique_ptr<Store>> OpenPostgres(const PostgresModule& module,
                                            const std::string& url,
                                            Access access,
                                            double patience_s);

/// Error (usage): this build cannot speak to PostgreSQL.
Result<const PostgresModule*> LoadedPostgresModule();

}  // namespace truetriad::fleet
