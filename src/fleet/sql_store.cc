// SPDX-License-Identifier: Apache-2.0
#include "fleet/sql_store.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <span>

#include "fleet/rows.h"

namespace truetriad::fleet {
namespace {

using Cell = std::optional<std::string>;

template <typename Number>
Number NumberOf(const Cell& cell, Number otherwise) {
  Number number = otherwise;
  if (cell) std::from_chars(cell->data(), cell->data() + cell->size(), number);
  return number;
}

KnownRun KnownRunOf(const std::vector<Cell>& row) {
  return {row[0].value_or(""),
          NumberOf<std::int64_t>(row[1], 0),
          NumberOf<std::int64_t>(row[2], 0),
          row[3].value_or(""),
          row[4].value_or(""),
          VerdictFromName(row[5].value_or("")).value_or(Verdict::kNoResult),
          row[6].value_or(""),
          {},
          row[9].value_or(""),
          row[10].value_or("")};
}

StationCheck StationCheckOf(const std::vector<Cell>& row) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  return {.id = row[0].value_or(""),
          .station = row[1].value_or(""),
          .serial = row[2].value_or(""),
          .created = row[3].value_or(""),
          .agrees = row[4] == "1",
          .p = NumberOf(row[5], kUnknown),
          .largest = NumberOf(row[6], kUnknown),
          .parameter = row[7].value_or(""),
          .log = row[8].value_or(""),
          .recording = row[9].value_or(""),
          .repeatability = row[10].value_or("")};
}

Verdict VerdictIn(const Cell& name) {
  return VerdictFromName(name.value_or("")).value_or(Verdict::kNoResult);
}

Disposition DispositionOf(const std::vector<Cell>& row) {
  return {.id = row[0].value_or(""),
          .serial = row[1].value_or(""),
          .created = row[2].value_or(""),
          .who = row[3].value_or(""),
          .why = row[4].value_or(""),
          .verdict = VerdictIn(row[5]),
          .run = row[6].value_or("")};
}

/// Error (usage): good is only what has a calibration.
Status CheckDecidable(const Disposition& disposition, Verdict of_run) {
  if (of_run != Verdict::kNoResult || disposition.verdict == Verdict::kFail) return {};
  return Error(ErrorCode::kConflictingArguments,
               "unit `" + disposition.serial + "` has no calibration (run " + disposition.run +
                   ", which counts, is `" + std::string(VerdictName(of_run)) +
                   "`), so cannot be `" + std::string(VerdictName(disposition.verdict)) +
                   "`; measure it again, or decide `FAIL`");
}

Standing StandingFrom(const std::vector<Cell>& row) {
  Standing standing{.run = row[0].value_or(""),
                    .first_verdict = VerdictIn(row[1]),
                    .final_verdict = VerdictIn(row[2]),
                    .attempts = NumberOf<std::int64_t>(row[3], 0),
                    .disposed_by = row[4].value_or(""),
                    .disposed_why = row[5].value_or(""),
                    .disposed_at = row[7].value_or("")};
  if (row[6]) standing.most = NumberOf<std::int64_t>(row[6], 0);
  return standing;
}

}  // namespace

Result<std::int64_t> SqlStore::Insert(const TableRows& rows) {
  const std::size_t count = rows.values.size() / rows.columns;
  const std::span<const Value> values(rows.values);
  std::int64_t inserted = 0;
  std::string sql;
  std::size_t rows_of_sql = 0;
  for (std::size_t row = 0; row < count;) {
    const std::size_t part = std::min(database_->rows_at_once(), count - row);
    if (part != rows_of_sql) sql = InsertStatement(rows.table, rows.columns, part);
    rows_of_sql = part;
    TRUETRIAD_ASSIGN_OR_RETURN(
        const std::int64_t more,
        database_->Run(sql, values.subspan(row * rows.columns, part * rows.columns)));
    inserted += more;
    row += part;
  }
  return inserted;
}

Result<Cell> SqlStore::Fact(std::string_view name) {
  const Value values[] = {name};
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kFactsOf, values));
  return table.rows.empty() ? Cell() : table.rows[0][0];
}

Status SqlStore::InsertRun(const UnitRun& run) {
  for (const TableRows& rows : RowsOf(run)) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t inserted, Insert(rows));
    // It is there already, with all that belongs to it.
    if (rows.table == kRunTable && inserted == 0) return {};
  }
  return {};
}

Status SqlStore::AddAll(std::span<const UnitRun> runs) {
  return database_->Transact(Access::kWrite, [&]() -> Status {
    for (const UnitRun& run : runs) TRUETRIAD_RETURN_IF_ERROR(InsertRun(run));
    return {};
  });
}

Result<bool> SqlStore::Has(const std::string& run) {
  bool has = false;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    const Value values[] = {std::string_view(run)};
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                               database_->Ask("SELECT run FROM run WHERE run = $1", values));
    has = !table.rows.empty();
    return {};
  }));
  return has;
}

Result<std::vector<KnownRun>> SqlStore::LastRuns() {
  std::vector<KnownRun> runs;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    runs.clear();
    for (std::string log;; log = runs.back().log) {
      const Value after[] = {std::string_view(log)};
      TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kLastRuns, after));
      if (table.rows.empty()) return {};
      for (const auto& row : table.rows) {
        if (runs.empty() || runs.back().log != row[0]) runs.push_back(KnownRunOf(row));
        SetTag(row[7].value_or(""), row[8].value_or(""), &runs.back().tags);
      }
    }
  }));
  return runs;
}

Status SqlStore::StateShard(const Shard& shard) {
  const std::string stated = std::to_string(shard.count);
  return database_->Transact(Access::kWrite, [&]() -> Status {
    TRUETRIAD_RETURN_IF_ERROR(Insert(FactRow("shards", stated)));
    TRUETRIAD_ASSIGN_OR_RETURN(const Cell there, Fact("shards"));
    return CheckShards(database_->name(), NumberOf<std::int64_t>(there, 1), shard.count);
  });
}

Result<std::optional<RetestPolicy>> SqlStore::PolicyThere() {
  TRUETRIAD_ASSIGN_OR_RETURN(const Cell counts, Fact("retest_counts"));
  TRUETRIAD_ASSIGN_OR_RETURN(const Cell most, Fact("retest_most"));
  if (!counts) return std::optional<RetestPolicy>();
  RetestPolicy policy{RetestCountsFromName(*counts).value_or(RetestCounts::kLast), std::nullopt};
  if (most) policy.most = NumberOf<std::int64_t>(most, 0);
  return std::optional(policy);
}

Status SqlStore::StateRetestPolicy(const RetestPolicy& policy) {
  constexpr std::int64_t kMost = 1'000'000;
  if (policy.most && (*policy.most < 0 || *policy.most > kMost)) {
    return Error(ErrorCode::kInvalidArgument,
                 "how many runs after the first may count: expected 0 to " + std::to_string(kMost));
  }
  return database_->Transact(Access::kWrite, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t inserted,
                               Insert(FactRow("retest_counts", RetestCountsName(policy.counts))));
    const std::string most = policy.most ? std::to_string(*policy.most) : "";
    if (inserted > 0 && policy.most) {
      TRUETRIAD_RETURN_IF_ERROR(Insert(FactRow("retest_most", most)));
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<RetestPolicy> there, PolicyThere());
    if (there == policy) return {};
    return Error(ErrorCode::kConflictingArguments,
                 database_->name() + ": of a unit's runs counts the one by `" +
                     PolicyText(there.value_or(RetestPolicy())) + "`, not by `" +
                     PolicyText(policy) + "`; state the same, or take another store");
  });
}

Result<std::optional<RetestPolicy>> SqlStore::StatedRetestPolicy() {
  std::optional<RetestPolicy> policy;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(policy, PolicyThere());
    return {};
  }));
  return policy;
}

Result<std::string> SqlStore::Identity() {
  std::string identity;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const Cell stated, Fact(kStoreFact));
    identity = stated.value_or("");
    return {};
  }));
  return identity;
}

Result<std::string> SqlStore::LatestRun(const UnitRun& run) {
  std::string latest;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    const Value values[] = {std::string_view(run.serial), std::string_view(run.log)};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Cell> row, Row(kLatestRun, values));
    latest = row.at(0).value_or("");
    return {};
  }));
  return latest;
}

Result<std::vector<RunName>> SqlStore::RunsOfSameReadings(const UnitRun& run) {
  std::vector<Value> values = {std::string_view(run.serial), std::string_view(run.log)};
  for (const InputFile& input : run.inputs) {
    if (input.samples > 0) values.emplace_back(std::string_view(input.sha256));
  }
  std::vector<RunName> runs;
  if (values.size() == 2) return runs;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table, database_->Ask(fleet::RunsOfSameReadings(values.size() - 2), values));
    runs.clear();
    for (const auto& row : table.rows) {
      runs.push_back({row[0].value_or(""), row[1].value_or(""), row[2].value_or("")});
    }
    return {};
  }));
  return runs;
}

Result<std::optional<Standing>> SqlStore::StandingOf(const std::string& serial) {
  std::optional<Standing> standing;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    const Value values[] = {std::string_view(serial)};
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kStandingOf, values));
    standing.reset();
    if (!table.rows.empty()) standing = StandingFrom(table.rows[0]);
    return {};
  }));
  return standing;
}

Result<std::vector<Cell>> SqlStore::Row(std::string_view sql, std::span<const Value> values) {
  TRUETRIAD_ASSIGN_OR_RETURN(Table table, database_->Ask(sql, values));
  return table.rows.empty() ? std::vector<Cell>() : std::move(table.rows[0]);
}

Result<bool> SqlStore::MakeLast(const std::string& table,
                                const std::string& other,
                                std::string* id) {
  const Value name[] = {std::string_view(*id)};
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::vector<Cell> same,
      Row("SELECT " + table + " FROM " + table + " WHERE " + table + " = $1", name));
  if (!same.empty()) return false;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Cell> greatest,
                             Row("SELECT max(" + table + ") FROM " + table, {}));
  const std::string last = std::max(greatest.at(0).value_or(""), other);
  if (last > *id) *id = NewRunIdAfter(last);
  return true;
}

Result<std::vector<std::string>> SqlStore::UnitsHeldBack() {
  std::vector<std::string> units;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kUnitsHeldBack, {}));
    units.clear();
    for (const auto& row : table.rows) units.push_back(row[0].value_or(""));
    return {};
  }));
  return units;
}

Result<std::vector<RunFolder>> SqlStore::FoldersOfUnit(const std::string& serial) {
  std::vector<RunFolder> folders;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    const Value values[] = {std::string_view(serial)};
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kFoldersOfUnit, values));
    folders.clear();
    for (const auto& row : table.rows) {
      folders.push_back({row[0].value_or(""), row[1].value_or(""), VerdictIn(row[2])});
    }
    return {};
  }));
  return folders;
}

Result<Disposition> SqlStore::Dispose(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckDisposition(disposition));
  Disposition added = disposition;
  const Status status = database_->Transact(Access::kWrite, [&]() -> Status {
    const Value serial[] = {std::string_view(disposition.serial)};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Cell> standing, Row(kStandingRun, serial));
    if (standing.empty()) {
      return Error(ErrorCode::kUnknownName,
                   database_->name() + ": has no unit `" + disposition.serial +
                       "`; `truetriad fleet query` lists those that it has");
    }
    added.run = standing[0].value_or("");
    TRUETRIAD_RETURN_IF_ERROR(CheckDecidable(added, VerdictIn(standing[1])));
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Cell> last, Row(kLastRunOfUnit, serial));
    TRUETRIAD_ASSIGN_OR_RETURN(const bool is_new,
                               MakeLast("disposition", last.at(0).value_or(""), &added.id));
    if (is_new) TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(added)));
    return {};
  });
  TRUETRIAD_RETURN_IF_ERROR(status);
  return added;
}

Result<std::optional<StationCheck>> SqlStore::AddStationCheck(const StationCheck& check) {
  StationCheck added = check;
  std::optional<StationCheck> first;
  const Status status = database_->Transact(Access::kWrite, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool is_new, MakeLast("station_check", "", &added.id));
    if (is_new) TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(added)));
    first.reset();
    if (added.recording.empty()) return {};
    const Value values[] = {std::string_view(added.station), std::string_view(added.recording)};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<Cell> row, Row(kFirstCheckOfRecording, values));
    if (row.at(0) != added.id) first = StationCheckOf(row);
    return {};
  });
  TRUETRIAD_RETURN_IF_ERROR(status);
  return first;
}

Result<Decisions> SqlStore::ReadDecisions() {
  Decisions decisions;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    decisions = Decisions();
    TRUETRIAD_ASSIGN_OR_RETURN(const Table dispositions, database_->Ask(kDispositions, {}));
    for (const auto& row : dispositions.rows) {
      decisions.dispositions.push_back(DispositionOf(row));
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Table checks, database_->Ask(kStationChecks, {}));
    for (const auto& row : checks.rows) decisions.checks.push_back(StationCheckOf(row));
    return {};
  }));
  return decisions;
}

Status SqlStore::AddDecisions(const Decisions& decisions) {
  return database_->Transact(Access::kWrite, [&]() -> Status {
    for (const Disposition& disposition : decisions.dispositions) {
      TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(disposition)));
    }
    for (const StationCheck& check : decisions.checks) {
      TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(check)));
    }
    return {};
  });
}

Result<std::optional<StationCheck>> SqlStore::LastStationCheck(const std::string& station) {
  std::optional<StationCheck> check;
  TRUETRIAD_RETURN_IF_ERROR(database_->Transact(Access::kRead, [&]() -> Status {
    const Value values[] = {std::string_view(station)};
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, database_->Ask(kLastStationCheck, values));
    check.reset();
    if (!table.rows.empty()) check = StationCheckOf(table.rows[0]);
    return {};
  }));
  return check;
}

}  // namespace truetriad::fleet
