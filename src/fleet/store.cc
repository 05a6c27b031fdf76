// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <algorithm>
#include <exception>
#include <map>
#include <span>
#include <unordered_map>

#include "fleet/database.h"
#include "fleet/json_lines.h"
#include "fleet/line_summary.h"
#include "tree/json.h"

namespace truetriad::fleet {
namespace {

/// The number of units whose runs are in memory at once.
constexpr int kUnitsAPage = 100;

/// Names of the facts for the number of shards and for the retest policy.
constexpr std::string_view kShardsFact = "shards", kCountsFact = "retest_counts",
                           kMostFact = "retest_most";

constexpr std::string_view kUnitsHeldBack =
    "SELECT serial FROM standing WHERE disposed_by <> '' OR serial IN (SELECT serial FROM run "
    "WHERE run IN (SELECT run FROM given_up)) OR (final_verdict IN ('FAIL', 'NO_RESULT') "
    "AND EXISTS (SELECT 1 FROM run WHERE run.serial = standing.serial AND run.run <> "
    "standing.run AND run.verdict <> 'NO_RESULT' AND run.folder <> '')) ORDER BY serial";
constexpr std::string_view kLatestRun =
    "SELECT max(run) FROM (SELECT max(run) AS run FROM run WHERE serial = $1 UNION ALL "
    "SELECT max(run) FROM run WHERE log = $2 UNION ALL "
    "SELECT max(disposition) FROM run AS its CROSS JOIN disposition "
    "WHERE its.serial = $1 AND disposition.run = its.run) AS either";

/// The columns of runs, as by ColumnsOf. A covariance is large; if it is not needed, it is NULL.
std::string RunColumns(bool has_covariance, const std::string& table = "") {
  std::string columns = ColumnsOf<UnitRun>(table);
  const std::string covariance = (table.empty() ? "" : table + ".") + "covariance";
  if (!has_covariance) columns.replace(columns.find(covariance), covariance.size(), "NULL");
  return columns;
}

/// Selects valid checks: a repeated check of the same recording at a station does not count.
std::string ChecksThatCount() {
  return "SELECT " + ColumnsOf<StationCheck>() +
         " FROM station_check AS one WHERE (recording = '' OR NOT EXISTS (SELECT 1 FROM "
         "station_check AS prior WHERE prior.station = one.station AND prior.serial = one.serial "
         "AND prior.recording = one.recording AND prior.station_check < one.station_check)) ";
}

/// Selects the last check of each golden unit at the station $1, by time of recording.
std::string LastChecks() {
  return "SELECT " + ColumnsOf<StationCheck>() +
         " FROM (SELECT counted.*, row_number() OVER (PARTITION BY serial ORDER BY recorded DESC, "
         "station_check DESC) AS nth FROM (" +
         ChecksThatCount() +
         "AND station = $1) AS counted) AS last WHERE nth = 1 ORDER BY recorded, station_check";
}

template <typename Thing>
std::vector<Thing> ThingsIn(const Table& table) {
  std::vector<Thing> things;
  things.reserve(table.rows.size());
  for (const auto& row : table.rows) things.push_back(FromRow<Thing>(row));
  return things;
}

/// The first field of a table; unset if there is none.
Cell FieldIn(const Table& table) { return table.rows.empty() ? Cell() : table.rows[0][0]; }

/// The value of a fact; empty if not stated.
std::string FactIn(const StoreFacts& facts, std::string_view name) {
  const auto found = facts.find(name);
  return found == facts.end() ? "" : found->second;
}

/// The stated policy; unset if none.
std::optional<RetestPolicy> PolicyIn(const StoreFacts& facts) {
  const std::string counts = FactIn(facts, kCountsFact), most = FactIn(facts, kMostFact);
  if (counts.empty()) return std::nullopt;
  RetestPolicy policy{RetestCountsFromName(counts).value_or(RetestCounts::kLast), std::nullopt};
  if (!most.empty()) policy.most = NumberOf<std::int64_t>(most, 0);
  return policy;
}

/// Error (usage): the decision is that a unit without a calibration is good.
Status CheckDecidable(const Disposition& disposition, Verdict of_run) {
  if (of_run != Verdict::kNoResult || disposition.verdict == Verdict::kFail) return {};
  return Error(ErrorCode::kConflictingArguments,
               "unit `" + disposition.serial + "` has no calibration (its current run " +
                   disposition.run + " is `" + std::string(VerdictName(of_run)) +
                   "`), so it cannot be `" + std::string(VerdictName(disposition.verdict)) +
                   "`; measure it again, or decide `FAIL`");
}

/// A table of runs' items. A row has the name of a run and one item, which `take` adds to it.
struct Part {
  std::string columns;
  std::string_view table, order;
  void (*take)(std::span<const Cell> row, UnitRun* run);
  bool is_of_whole = false;  ///< Read only if RunSelection::is_whole.
};

template <typename Thing, std::vector<Thing> UnitRun::*kList>
Part PartOf(std::string_view table, bool is_of_whole = false) {
  return {
      ColumnsOf<Thing>(),
      table,
      "place",
      [](std::span<const Cell> row, UnitRun* run) { (run->*kList).push_back(FromRow<Thing>(row)); },
      is_of_whole};
}

void TakeFinding(std::span<const Cell> row, UnitRun* run) {
  Json json;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const std::string_view column = kFindingColumns[i];
    const bool is_json = column == "pose" || column == "values";
    if (row[i]) json[std::string(column)] = is_json ? Json::parse(*row[i]) : Json(*row[i]);
  }
  run->findings.push_back(FindingFrom(json));
}

const std::vector<Part>& Parts() {
  static const auto& parts =
      *new std::vector<Part>{{"name, value",
                              "tag",
                              "name",
                              [](std::span<const Cell> row, UnitRun* run) {
                                SetTag(row[0].value_or(""), row[1].value_or(""), &run->tags);
                              }},
                             PartOf<InputFile, &UnitRun::inputs>("input", true),
                             PartOf<SensorReadings, &UnitRun::readings>("reading", true),
                             PartOf<Parameter, &UnitRun::parameters>("parameter"),
                             {std::string(kFindingSelected), "finding", "place", TakeFinding, true},
                             PartOf<LimitCheck, &UnitRun::judgements>("judgement")};
  return parts;
}

/// Reads a run or standing from a row. Error (bad input): its verdict is unknown.
template <typename Thing>
Result<Thing> CheckedFromRow(std::span<const Cell> row) {
  Thing thing;
  RowReader reader{row};
  Fields(reader, thing);
  if (reader.odd_verdict.empty()) return thing;
  return Error(ErrorCode::kWrongFormat,
               "run " + row[0].value_or("") + ": its verdict is `" + reader.odd_verdict +
                   "`, which is not a verdict; the store has been changed by another program");
}

/// The FROM and WHERE of a selection.
std::string SourceOf(const RunSelection& which) {
  const std::string source = which.only_standing ? "standing" : "run";
  // Each tag costs a subquery, so tags are joined only if `where` may name one.
  if (which.where.empty()) return " FROM " + source + " WHERE TRUE";
  return FromWhere(source, which.where);
}

/// The run with only the fields that queries for a file of runs need.
UnitRun Known(UnitRun run) {
  run.parameters.clear(), run.covariance.clear(), run.findings.clear(), run.judgements.clear();
  return run;
}

}  // namespace

Store::Store(std::unique_ptr<Database> database) : database_(std::move(database)) {}
Store::~Store() = default;

Result<std::unique_ptr<Store>> Store::Open(std::unique_ptr<Database> database) {
  std::unique_ptr<Store> store(new Store(std::move(database)));
  TRUETRIAD_ASSIGN_OR_RETURN(const StoreFacts facts, store->StateFacts({}));
  TRUETRIAD_RETURN_IF_ERROR(
      CheckSchemaVersion(store->database_->name(), FactIn(facts, kSchemaVersionName)));
  return store;
}

Result<std::unique_ptr<Store>> Store::OpenLines(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Database> database, OpenPassingSqlite(path));
  std::unique_ptr<Store> store(new Store(std::move(database)));
  const Status opened = store->Transact(Access::kWrite, [&]() -> Status {
    const auto note = [&store](UnitRun run) { return store->InsertRun(Known(std::move(run))); };
    TRUETRIAD_ASSIGN_OR_RETURN(store->lines_, RunLines::Open(path, note));
    return {};
  });
  TRUETRIAD_RETURN_IF_ERROR(opened);
  if (!store->lines_->HasBegun()) return store;
  const StoreHeader& header = store->lines_->header();
  TRUETRIAD_RETURN_IF_ERROR(
      store->StateShard({header.shards.only.value_or(0), header.shards.count}));
  // The header is written, so the policy cannot change any more.
  TRUETRIAD_RETURN_IF_ERROR(store->StateRetestPolicy(header.policy.value_or(RetestPolicy())));
  return store;
}

Result<std::int64_t> Store::Insert(const TableRows& rows) {
  std::int64_t inserted = 0;
  std::string sql;
  std::size_t rows_of_sql = 0;
  for (auto row = rows.rows.begin(); row != rows.rows.end();) {
    const std::size_t part =
        std::min<std::size_t>(database_->rows_at_once(), rows.rows.end() - row);
    if (part != rows_of_sql) sql = InsertStatement(rows.table, row->size(), part);
    rows_of_sql = part;
    std::vector<Value> values;
    for (const auto end = row + static_cast<std::ptrdiff_t>(part); row != end; ++row) {
      values.insert(values.end(), row->begin(), row->end());
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t more, database_->Run(sql, values));
    inserted += more;
  }
  return inserted;
}

Status Store::InsertRun(const UnitRun& run) {
  for (const TableRows& rows : RowsOf(run)) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t inserted, Insert(rows));
    // The run exists already, with all of its parts.
    if (rows.table == kRunTable && inserted == 0) return {};
  }
  return {};
}

Status Store::AddAll(std::span<const UnitRun> runs) {
  for (const UnitRun& run : runs) {
    if (!lines_) break;
    if (!lines_->HasBegun()) {
      TRUETRIAD_RETURN_IF_ERROR(StateShard(ShardFromText(run.shard).value_or(Shard())));
    }
    TRUETRIAD_RETURN_IF_ERROR(lines_->Add(run));
  }
  return Transact(Access::kWrite, [&]() -> Status {
    for (const UnitRun& run : runs) {
      TRUETRIAD_RETURN_IF_ERROR(lines_ ? InsertRun(Known(run)) : InsertRun(run));
    }
    return {};
  });
}

Result<Table> Store::Asked(std::string_view sql, const std::vector<Value>& values) {
  Table table;
  TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kRead, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(table, database_->Ask(sql, values));
    return {};
  }));
  return table;
}

template <typename Thing>
Result<std::vector<Thing>> Store::Things(const std::string& sql, const std::vector<Value>& values) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Asked(sql, values));
  return ThingsIn<Thing>(table);
}

Result<std::string> Store::Text(std::string_view sql, const std::vector<Value>& values) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Asked(sql, values));
  return FieldIn(table).value_or("");
}

Result<std::vector<UnitRun>> Store::RunsWhere(const std::string& condition,
                                              const std::vector<Value>& values) {
  return Things<UnitRun>("SELECT " + RunColumns(false) + " FROM run WHERE " + condition, values);
}

Result<bool> Store::Has(const std::string& run) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string found,
                             Text("SELECT run FROM run WHERE run = $1", {run}));
  return !found.empty();
}

Status Store::ForEachLastRun(const std::function<void(const UnitRun&)>& take) {
  // Reads logs in batches, each from the first log after $1 on: a million are too many for memory.
  // A run has one row for each of its tags; without tags, it has one row.
  const std::string last_runs =
      "SELECT " + RunColumns(false, "last") +
      ", tag.name, tag.value FROM (SELECT * FROM run AS one WHERE log > $1 AND NOT EXISTS (SELECT "
      "1 FROM run AS later WHERE later.log = one.log AND later.run > one.run) ORDER BY log LIMIT "
      "10000) AS last LEFT JOIN tag ON tag.run = last.run ORDER BY last.log";
  for (UnitRun run;;) {
    const std::string log = std::exchange(run, UnitRun()).log;
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Asked(last_runs, {log}));
    if (table.rows.empty()) return {};
    for (const auto& row : table.rows) {
      if (run.id != row[0]) {
        if (!run.id.empty()) take(run);
        run = FromRow<UnitRun>(row);
      }
      const std::size_t tag = row.size() - 2;
      SetTag(row[tag].value_or(""), row[tag + 1].value_or(""), &run.tags);
    }
    take(run);
  }
}

Result<StoreFacts> Store::StateFacts(
    const std::vector<std::pair<std::string_view, std::string>>& stated) {
  StoreFacts facts;
  const auto state = [&]() -> Status {
    for (const auto& [name, value] : stated) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t inserted, Insert({"fact", {{name, value}}}));
      if (inserted == 0) break;
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Asked("SELECT name, value FROM fact"));
    facts.clear();
    for (const auto& row : table.rows) facts[row[0].value_or("")] = row[1].value_or("");
    return {};
  };
  TRUETRIAD_RETURN_IF_ERROR(Transact(stated.empty() ? Access::kRead : Access::kWrite, state));
  return facts;
}

Status Store::StateShard(const Shard& shard) {
  const std::string stated = std::to_string(shard.count);
  TRUETRIAD_ASSIGN_OR_RETURN(const StoreFacts facts, StateFacts({{kShardsFact, stated}}));
  if (FactIn(facts, kShardsFact) != stated) {
    const std::string there = FactIn(facts, kShardsFact);
    return Error(ErrorCode::kConflictingArguments,
                 database_->name() + ": its shard count is " + there + ", not " + stated +
                     "; give --shard=I/" + there + ", or another store");
  }
  if (!lines_) return {};
  if (!lines_->HasBegun()) {
    TRUETRIAD_ASSIGN_OR_RETURN(StoreHeader header, Header());
    header.shards.only = shard.index;
    return lines_->Begin(header);
  }
  const std::optional<int> only = lines_->header().shards.only;
  if (only.value_or(shard.index) == shard.index) return {};
  return Error(ErrorCode::kConflictingArguments,
               database_->name() + ": holds the runs of shard " + std::to_string(*only) + " of " +
                   stated + ", not of " + ShardText(shard) + "; give each shard a file of its own");
}

Result<StoreHeader> Store::Header() {
  if (lines_ && lines_->HasBegun()) return lines_->header();
  TRUETRIAD_ASSIGN_OR_RETURN(const StoreFacts facts, StateFacts({}));
  StoreHeader header{.shards = {}, .store = FactIn(facts, kStoreFact), .policy = PolicyIn(facts)};
  if (!facts.contains(kShardsFact)) return header;
  const std::string stated = FactIn(facts, kShardsFact);
  const std::optional<Shard> last = ShardFromText("0/" + stated);
  if (!last) {
    return Error(ErrorCode::kStoreFailure,
                 "its table `fact` states that `shards` is `" + stated +
                     "`, not a number of shards; the store has been changed by another program");
  }
  header.shards.count = last->count;
  return header;
}

Status Store::StateRetestPolicy(const RetestPolicy& policy) {
  constexpr std::int64_t kMost = 1'000'000;  // Chosen: above any real count.
  if (policy.most && (*policy.most < 0 || *policy.most > kMost)) {
    return Error(ErrorCode::kInvalidArgument,
                 "--retest-most: expected a number of recordings after the first, 0 to " +
                     std::to_string(kMost));
  }
  const bool has_none = lines_ && lines_->HasBegun() && !lines_->header().policy;
  if (has_none && policy != RetestPolicy()) {
    return Error(ErrorCode::kConflictingArguments,
                 database_->name() + ": was begun without a retest policy, so `" +
                     PolicyText(RetestPolicy()) + "` holds; state no policy, or name another file");
  }
  std::vector<std::pair<std::string_view, std::string>> stated = {
      {kCountsFact, std::string(RetestCountsName(policy.counts))}};
  if (policy.most) stated.emplace_back(kMostFact, std::to_string(*policy.most));
  TRUETRIAD_ASSIGN_OR_RETURN(const StoreFacts facts, StateFacts(stated));
  const RetestPolicy there = PolicyIn(facts).value_or(RetestPolicy());
  if (there == policy) return {};
  return Error(ErrorCode::kConflictingArguments,
               database_->name() + ": its retest policy is `" + PolicyText(there) + "`, not `" +
                   PolicyText(policy) + "`; state the same, or name another store");
}

Result<std::string> Store::LatestRun(const UnitRun& run) {
  return Text(kLatestRun, {run.serial, run.log});
}

Result<std::string> Store::FailedSinceGood(const UnitRun& run) {
  return Text(
      "SELECT max(run) FROM run WHERE serial = $1 AND verdict = 'FAIL' AND run > "
      "COALESCE((SELECT max(good.run) FROM run AS good WHERE good.serial = $1 AND "
      "good.run <> $2 AND good.verdict IN ('PASS', 'NO_LIMITS')), '')",
      {run.serial, run.id});
}

Result<std::optional<UnitRun>> Store::RunOfSameReadings(const UnitRun& run) {
  std::vector<Value> values = {std::string_view(run.serial)};
  std::string runs;
  for (const SensorReadings& one : run.readings) {
    values.emplace_back(std::string_view(one.digest));
    runs += (runs.empty() ? "" : " INTERSECT ") +
            ("SELECT run FROM reading WHERE digest = $" + std::to_string(values.size()));
  }
  if (runs.empty()) return std::optional<UnitRun>();
  TRUETRIAD_ASSIGN_OR_RETURN(
      std::vector<UnitRun> others,
      RunsWhere("serial <> $1 AND verdict <> 'NO_RESULT' AND run IN (" + runs +
                    ") AND run NOT IN (SELECT run FROM given_up) ORDER BY run LIMIT 1",
                values));
  return others.empty() ? std::optional<UnitRun>() : std::optional(std::move(others.front()));
}

Result<std::vector<UnitRun>> Store::RunsGivenUp() {
  return RunsWhere("run IN (SELECT run FROM given_up)");
}

Result<std::map<std::string, Standing>> Store::GivenUpOf(const std::string& serial) {
  std::map<std::string, Standing> given_up;
  if (lines_) return given_up;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      Asked("SELECT run.run, who, why, disposition.created FROM given_up JOIN disposition ON "
            "disposition.disposition = given_up.disposition JOIN run ON run.run = "
            "given_up.run WHERE serial = $1",
            {serial}));
  for (const auto& row : table.rows) {
    given_up[row[0].value_or("")] = {.run = row[0].value_or(""),
                                     .final_verdict = Verdict::kFail,
                                     .disposed_by = row[1].value_or(""),
                                     .disposed_why = "wrong serial number: " + row[2].value_or(""),
                                     .disposed_at = row[3].value_or("")};
  }
  return given_up;
}

Result<std::optional<Standing>> Store::StandingOf(const std::string& serial) {
  if (lines_) return std::optional<Standing>();
  const std::string standing_of =
      "SELECT " + ColumnsOf<Standing>() +
      ", (SELECT value FROM fact WHERE name = 'retest_most'), (SELECT max(one.run) "
      "FROM run AS one WHERE one.serial = $1 AND one.recorded_by <> 'file' AND one.recorded <> '' "
      "AND one.recorded = standing.recorded AND one.log <> standing.log) FROM standing "
      "WHERE serial = $1";
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Asked(standing_of, {serial}));
  if (table.rows.empty()) return std::optional<Standing>();
  std::optional<Standing> standing = FromRow<Standing>(table.rows[0]);
  const std::span<const Cell> more = std::span<const Cell>(table.rows[0]).last(2);
  if (more[0]) standing->most = NumberOf<std::int64_t>(more[0], 0);
  standing->tied_with = more[1].value_or("");
  return standing;
}

Result<bool> Store::MakeLast(const std::string& table, const std::string& other, std::string* id) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::string same,
      Text("SELECT " + table + " FROM " + table + " WHERE " + table + " = $1", {*id}));
  if (!same.empty()) return false;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string greatest,
                             Text("SELECT max(" + table + ") FROM " + table));
  const std::string last = std::max(greatest, other);
  if (last > *id) *id = NewRunIdAfter(last);
  return true;
}

Result<std::vector<std::string>> Store::UnitsHeldBack() {
  return lines_ ? std::vector<std::string>() : QueryTexts(std::string(kUnitsHeldBack));
}

Result<std::vector<UnitRun>> Store::LogsOfUnitsNotGood() {
  return RunsWhere(
      "serial IN (SELECT serial FROM standing WHERE final_verdict IN ('FAIL', 'NO_RESULT')) AND "
      "run = (SELECT max(one.run) FROM run AS one WHERE one.log = run.log)");
}

Result<std::string> Store::UnitOfOtherLetters(const std::string& serial) {
  return Text("SELECT min(serial) FROM unit WHERE lower(serial) = lower($1) AND serial <> $1",
              {serial});
}

Result<std::vector<UnitRun>> Store::FoldersOfUnit(const std::string& serial) {
  if (lines_) return std::vector<UnitRun>();
  return RunsWhere("serial = $1 AND folder <> '' ORDER BY run", {serial});
}

Status Store::CheckReadings(const Disposition& disposition) {
  if (disposition.GivesUp()) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string given_up,
                             Text("SELECT run FROM given_up WHERE run = $1", {disposition.run}));
  // A refusal takes the readings back only if it states that the serial number was right.
  const bool takes_back = disposition.wrong_serial.has_value();
  if (disposition.verdict == Verdict::kFail && (given_up.empty() || !takes_back)) return {};
  // If the run was refused before its readings were read, another run of the recording has them.
  UnitRun own;
  own.serial = disposition.serial;
  TRUETRIAD_ASSIGN_OR_RETURN(
      own.readings,
      Things<SensorReadings>(
          "SELECT " + ColumnsOf<SensorReadings>() +
              " FROM reading WHERE run = (SELECT max(same.run) FROM measured AS own "
              "CROSS JOIN measured AS same WHERE own.run = $1 AND same.serial = own.serial "
              "AND same.first_run = own.first_run "
              "AND EXISTS (SELECT 1 FROM reading AS its WHERE its.run = same.run))",
          {disposition.run}));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<UnitRun> holder, RunOfSameReadings(own));
  if (!holder && (given_up.empty() || takes_back)) return {};
  if (!holder) {
    return Error(
        ErrorCode::kConflictingArguments,
        "unit `" + disposition.serial + "` cannot be `" +
            std::string(VerdictName(disposition.verdict)) + "` by run " + disposition.run +
            ", whose serial number was wrong; measure the unit, or, if the number was right, "
            "state this by --wrong-serial=false");
  }
  return Error(
      ErrorCode::kConflictingArguments,
      "unit `" + disposition.serial + "` cannot be `" +
          std::string(VerdictName(disposition.verdict)) + "` by run " + disposition.run +
          ": its readings belong to unit `" + holder->serial + "` (run " + holder->id + ", " +
          holder->log +
          "); first state for that unit that its serial number was wrong (--wrong-serial)");
}

Status Store::CheckIsOfUnit(const Disposition& disposition, const std::string& counting) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string own,
                             Text("SELECT run FROM run WHERE serial = $1 AND run = $2",
                                  {disposition.serial, disposition.run}));
  if (own.empty()) {
    return Error(ErrorCode::kUnknownName,
                 database_->name() + ": unit `" + disposition.serial + "` has no run `" +
                     disposition.run + "`");
  }
  if (disposition.verdict == Verdict::kFail || disposition.run == counting) return {};
  return Error(ErrorCode::kConflictingArguments,
               "unit `" + disposition.serial + "` cannot be `" +
                   std::string(VerdictName(disposition.verdict)) + "` by run " + disposition.run +
                   ", since the current run is " + counting);
}

Result<std::string> Store::OnlyRecording(const std::string& serial, bool is_given_up) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table results,
      Asked(
          "SELECT run, log FROM run WHERE run IN (SELECT max(run) FROM measured WHERE serial = $1 "
          "AND verdict <> 'NO_RESULT' AND run " +
              std::string(is_given_up ? "" : "NOT ") +
              "IN (SELECT run FROM given_up) GROUP BY first_run) ORDER BY run",
          {serial}));
  if (results.rows.size() <= 1) return FieldIn(results).value_or("");
  std::string runs;
  for (const auto& row : results.rows) {
    runs += (runs.empty() ? "" : ", ") + row[0].value_or("") + " (" + row[1].value_or("") + ")";
  }
  return Error(ErrorCode::kMissingArgument,
               "unit `" + serial + "` has several recordings" +
                   (is_given_up ? " with a wrong serial number" : "") +
                   "; name with --run the one whose serial number was " +
                   (is_given_up ? "right: " : "wrong: ") + runs);
}

Result<Disposition> Store::Dispose(const Disposition& disposition) {
  if (lines_) return NoQuestions(database_->name());
  TRUETRIAD_RETURN_IF_ERROR(CheckDisposition(disposition));
  Disposition added = disposition;
  const Status status = Transact(Access::kWrite, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table standing,
        Asked("SELECT run, verdict FROM standing WHERE serial = $1", {disposition.serial}));
    if (standing.rows.empty()) {
      return Error(ErrorCode::kUnknownName,
                   database_->name() + ": has no unit `" + disposition.serial +
                       "`; `truetriad fleet query` lists its units");
    }
    const std::string counting = standing.rows[0][0].value_or("");
    added.run = disposition.run;
    if (added.run.empty() && added.wrong_serial) {
      TRUETRIAD_ASSIGN_OR_RETURN(added.run, OnlyRecording(added.serial, !*added.wrong_serial));
    }
    if (added.run.empty()) added.run = counting;
    TRUETRIAD_RETURN_IF_ERROR(CheckIsOfUnit(added, counting));
    TRUETRIAD_RETURN_IF_ERROR(CheckDecidable(
        added, VerdictFromName(standing.rows[0][1].value_or("")).value_or(Verdict::kNoResult)));
    TRUETRIAD_RETURN_IF_ERROR(CheckReadings(added));
    TRUETRIAD_ASSIGN_OR_RETURN(
        const std::string last,
        Text("SELECT max(run) FROM run WHERE serial = $1", {disposition.serial}));
    TRUETRIAD_ASSIGN_OR_RETURN(const bool is_new, MakeLast("disposition", last, &added.id));
    if (is_new) TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(added)));
    return {};
  });
  TRUETRIAD_RETURN_IF_ERROR(status);
  return added;
}

Result<std::optional<StationCheck>> Store::AddStationCheck(const StationCheck& check) {
  if (lines_) return NoQuestions(database_->name());
  StationCheck added = check;
  std::optional<StationCheck> counting;
  const Status status = Transact(Access::kWrite, [&]() -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool is_new, MakeLast("station_check", "", &added.id));
    if (is_new) TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(added)));
    counting.reset();
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<StationCheck> last, LastStationChecks(added.station));
    const auto own = std::ranges::find(last, added.serial, &StationCheck::serial);
    if (own != last.end() && own->id != added.id) counting = std::move(*own);
    return {};
  });
  TRUETRIAD_RETURN_IF_ERROR(status);
  return counting;
}

Result<Decisions> Store::ReadDecisions() {
  if (lines_) return NoQuestions(database_->name());
  const std::string dispositions =
      "SELECT " + ColumnsOf<Disposition>("disposition") +
      ", serial FROM disposition JOIN run ON run.run = disposition.run ORDER BY disposition";
  const std::string checks =
      "SELECT " + ColumnsOf<StationCheck>() + " FROM station_check ORDER BY station_check";
  TRUETRIAD_ASSIGN_OR_RETURN(const Table decided, Asked(dispositions));
  Decisions decisions{ThingsIn<Disposition>(decided), {}};
  TRUETRIAD_ASSIGN_OR_RETURN(decisions.checks, Things<StationCheck>(checks));
  for (std::size_t i = 0; i < decided.rows.size(); ++i) {
    decisions.dispositions[i].serial = decided.rows[i].back().value_or("");
  }
  return decisions;
}

Status Store::AddDecisions(const Decisions& decisions) {
  if (lines_) return NoQuestions(database_->name());
  return Transact(Access::kWrite, [&]() -> Status {
    for (const Disposition& disposition : decisions.dispositions) {
      TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(disposition)));
    }
    for (const StationCheck& check : decisions.checks) {
      TRUETRIAD_RETURN_IF_ERROR(Insert(RowOf(check)));
    }
    return {};
  });
}

Result<std::vector<StationCheck>> Store::StationChecks() {
  if (lines_) return NoQuestions(database_->name());
  return Things<StationCheck>(ChecksThatCount() + "ORDER BY recorded, station_check");
}

Result<std::vector<StationCheck>> Store::LastStationChecks(const std::string& station) {
  if (lines_) return NoQuestions(database_->name());
  return Things<StationCheck>(LastChecks(), {station});
}

Status Store::TakeStandings(const std::string& condition, std::vector<UnitRun>* runs) {
  if (runs->empty()) return {};
  std::unordered_map<std::string_view, UnitRun*> by_name;
  for (UnitRun& run : *runs) by_name[run.id] = &run;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      Query("SELECT " + ColumnsOf<Standing>() + " FROM standing WHERE " + condition));
  for (const auto& row : table.rows) {
    const auto found = by_name.find(*row[0]);
    if (found == by_name.end()) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(found->second->standing, CheckedFromRow<Standing>(row));
  }
  return {};
}

Status Store::Transact(Access access, const std::function<Status()>& work) {
  if (is_in_transaction_) return work();
  is_in_transaction_ = true;
  const Status status = database_->Transact(access, [&]() -> Status {
    try {
      return work();
    } catch (const std::exception& failure) {
      return Error(ErrorCode::kSystemFailure, failure.what());
    }
  });
  is_in_transaction_ = false;
  return status;
}

Status Store::Together(const std::function<Status()>& work) {
  return Transact(Access::kWrite, work);
}

Result<std::vector<UnitRun>> Store::RunsOfPage(const RunSelection& which,
                                               const std::string& condition) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                             Query("SELECT " + RunColumns(which.is_whole) + SourceOf(which) +
                                   " AND " + condition + " ORDER BY serial, run"));
  std::vector<UnitRun> runs;
  std::map<std::string_view, UnitRun*> by_name;
  runs.reserve(table.rows.size());
  for (const auto& row : table.rows) {
    TRUETRIAD_ASSIGN_OR_RETURN(UnitRun one, CheckedFromRow<UnitRun>(row));
    runs.push_back(std::move(one));
    by_name[runs.back().id] = &runs.back();
  }
  if (runs.empty()) return runs;
  for (const Part& part : Parts()) {
    if (part.is_of_whole && !which.is_whole) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table rows,
        Query("SELECT run, " + part.columns + " FROM " + std::string(part.table) +
              " WHERE run IN (SELECT run FROM run WHERE " + condition + ") ORDER BY run, " +
              std::string(part.order)));
    for (const auto& row : rows.rows) {
      // Runs that were not selected are skipped.
      const auto found = by_name.find(*row[0]);
      if (found != by_name.end()) part.take(std::span(row).subspan(1), found->second);
    }
  }
  return runs;
}

Status Store::ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take) {
  std::string after;  // SQL: units after the last one that was read.
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table last,
        Query("SELECT max(serial) FROM (SELECT serial FROM unit" +
              (after.empty() ? "" : " WHERE " + after) + " ORDER BY serial LIMIT " +
              std::to_string(kUnitsAPage) + ") AS page"));
    if (!FieldIn(last)) return {};
    const std::string quoted = SqlText(*FieldIn(last));
    const std::string of_units = (after.empty() ? "" : after + " AND ") + "serial <= " + quoted;
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<UnitRun> runs, RunsOfPage(which, of_units));
    if (which.with_standing) TRUETRIAD_RETURN_IF_ERROR(TakeStandings(of_units, &runs));
    for (UnitRun& run : runs) TRUETRIAD_RETURN_IF_ERROR(take(std::move(run)));
    after = "serial > " + quoted;
  }
}

Result<std::vector<UnitRun>> Store::ReadRuns(const std::vector<std::string>& runs) {
  std::string names;
  for (const std::string& run : runs) names += (names.empty() ? "" : ", ") + SqlText(run);
  if (names.empty()) return std::vector<UnitRun>();
  return RunsOfPage({}, "run IN (" + names + ")");
}

Status Store::MarkEnd() { return lines_ ? lines_->End() : Status(); }

Result<Table> Store::Query(const std::string& sql) {
  if (lines_) return NoQuestions(database_->name());
  return is_in_transaction_ ? database_->Ask(sql, {}) : database_->AskAsGiven(sql);
}

Result<std::vector<std::string>> Store::QueryTexts(const std::string& sql) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Query(sql));
  std::vector<std::string> texts;
  for (const auto& row : table.rows) texts.push_back(row[0].value_or(""));
  return texts;
}

Status Store::AllowTypedText() { return database_->AllowTypedText(); }

void Store::TellNotes(std::function<void(const std::string&)> on_note) {
  database_->TellNotes(std::move(on_note));
}

}  // namespace truetriad::fleet
