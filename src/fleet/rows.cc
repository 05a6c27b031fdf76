// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <charconv>
#include <utility>

#include "fleet/database.h"
#include "model/finding_fields.h"
#include "tree/to_tree.h"

namespace truetriad::fleet {
namespace {

/// Indices and views over the tables, for SQLite and PostgreSQL alike.
///
/// A run is never changed. `latest` has the run of each unit with the greatest name, `standing` the
/// current run. The column `covariance` has the lower triangle, row by row, for the run's
/// parameters in their order, as doubles with the least significant byte first.
///
/// `measured` has for each run the first run of the same unit and recording (first_run). An earlier
/// run is of the same recording if it read the same unchanged log, or has all readings that the
/// later run used, sensor by sensor. An attempt is a recording, however often it is calibrated.
///
/// `given_up` has the runs of recordings for which a person stated that the serial number was wrong
/// (`wrong_serial` is 1) and no person stated later that it was right (0); a decision with NULL
/// changes nothing. Such runs do not count. But if a unit has only such runs, the last of them is
/// its current run, with 0 attempts.
///
/// `recorded` is the time of measurement (ISO 8601, UTC), `recorded_by` its source: "list",
/// "recording" or "file". Runs are ordered by this time, runs without a time first. Runs of the
/// same second, and runs without a time, are ordered by name, that is by the time of calibration.
///
/// `standing` has the current run of each unit. Only the newest run of each recording can be the
/// current run. (The cross join makes SQLite choose once for each unit, not once for each run.)
/// Recordings are ordered by time of measurement: the time that the newest list states, or, without
/// a list, that of the recording's first run. This time is `recorded`; `before` is the number of
/// earlier recordings. A unit with one run costs about ten microseconds, one with 200 runs about
/// ten milliseconds. A concession holds only for the recording of its run and for the limits missed
/// there. A refusal holds for all recordings except those that were first calibrated and also
/// measured after it; their time of measurement must be by the recording's own clock or a list,
/// since a file's time may be that of its last copy. (In an export of current runs only, a decision
/// may name a run that was made after the decision.)
constexpr std::string_view kViews = R"sql(
CREATE INDEX run_of_unit ON run (serial, run, verdict);
CREATE INDEX run_of_log ON run (log, run);
CREATE INDEX reading_of_content ON reading (digest, run);
CREATE INDEX unit_of_letters ON unit (lower(serial));
CREATE INDEX disposition_of_run ON disposition (run, disposition);
CREATE INDEX check_of_station ON station_check (station, station_check);
CREATE VIEW measured AS
  SELECT
    one.run,
    one.serial,
    one.verdict,
    one.recorded_by,
    CASE WHEN one.run = (SELECT min(seen.run) FROM run AS seen WHERE seen.serial = one.serial)
    THEN one.run
    ELSE (
      SELECT min(seen.run) FROM (
        SELECT (
          SELECT same.run FROM run AS same
          WHERE same.log = one.log AND same.serial = one.serial
            AND same.log_bytes = one.log_bytes AND same.log_modified_ns = one.log_modified_ns
          ORDER BY same.run LIMIT 1
        ) AS run
        UNION ALL
        SELECT (
          SELECT shared.run FROM reading AS shared CROSS JOIN run AS same
          WHERE shared.digest = (
              SELECT made_from.digest FROM reading AS made_from
              WHERE made_from.run = one.run ORDER BY made_from.place LIMIT 1
            )
            AND shared.run <= one.run AND same.run = shared.run AND same.serial = one.serial
            AND NOT EXISTS (
              SELECT 1 FROM reading AS made_from
              WHERE made_from.run = one.run AND NOT EXISTS (
                SELECT 1 FROM reading AS known
                WHERE known.run = shared.run AND known.digest = made_from.digest
              )
            )
          ORDER BY shared.run LIMIT 1
        ) AS run
      ) AS seen
    ) END AS first_run
  FROM run AS one;
CREATE VIEW given_up AS
  SELECT own.run, said.disposition
  FROM disposition AS said CROSS JOIN measured AS about CROSS JOIN measured AS own
  WHERE said.wrong_serial = 1 AND about.run = said.run
    AND own.serial = about.serial AND own.first_run = about.first_run
    AND said.disposition = {said_of_serial};
CREATE VIEW latest AS
  SELECT * FROM run AS one
  WHERE NOT EXISTS (SELECT 1 FROM run AS later WHERE later.serial = one.serial AND later.run > one.run);
CREATE VIEW standing AS
  SELECT
    {run_columns},
    (SELECT its.verdict FROM {recordings} AS recording CROSS JOIN run AS its CROSS JOIN run AS said
      WHERE its.run = recording.first_run AND said.run = recording.said_by
      ORDER BY recording.is_given_up, said.recorded, its.run LIMIT 1)
      AS first_verdict,
    (SELECT count(*) FROM measured AS own
      WHERE own.serial = unit.serial AND own.first_run = own.run AND NOT {is_given_up}) AS attempts,
    COALESCE(decision.verdict, run.verdict) AS final_verdict,
    decision.who AS disposed_by,
    CASE WHEN decision.wrong_serial = 1 THEN 'wrong serial number: ' ELSE '' END || decision.why
      AS disposed_why,
    decision.created AS disposed_at
  FROM unit
  CROSS JOIN run
  LEFT JOIN disposition AS decision ON decision.disposition = (
      SELECT max(one.disposition)
      FROM run AS its CROSS JOIN disposition AS one
      WHERE its.serial = unit.serial AND one.run = its.run
        AND (one.wrong_serial IS DISTINCT FROM 1 OR EXISTS (
          SELECT 1 FROM measured AS own CROSS JOIN measured AS about
          WHERE own.run = run.run AND about.run = one.run AND about.first_run = own.first_run
        ))
    )
    AND EXISTS (
      SELECT 1 FROM measured AS its CROSS JOIN measured AS made CROSS JOIN run AS timed
      WHERE its.run = run.run AND made.run = decision.run AND timed.run = {said_by} AND (
          its.first_run IN (made.run, made.first_run) OR (
            decision.verdict = 'FAIL'
            AND (its.first_run <= decision.disposition OR its.first_run <= decision.run
              OR timed.recorded_by = 'file' OR timed.recorded <= decision.created)
          )
        )
    )
    AND (
      decision.verdict = 'FAIL' OR run.verdict <> 'NO_RESULT' AND NOT EXISTS (
        SELECT 1 FROM judgement AS missed
        WHERE missed.run = run.run AND missed.pass = 0 AND NOT EXISTS (
          SELECT 1 FROM judgement AS conceded
          WHERE conceded.run = decision.run AND conceded.pass = 0
            AND conceded.name = missed.name AND conceded.component IS NOT DISTINCT FROM missed.component
            AND conceded.lower IS NOT DISTINCT FROM missed.lower
            AND conceded.upper IS NOT DISTINCT FROM missed.upper
        )
      )
    )
  WHERE run.serial = unit.serial AND run.run = (
    SELECT counted.run
    FROM (
      SELECT
        newest.run,
        its.verdict,
        newest.is_given_up,
        row_number() OVER (ORDER BY newest.is_given_up, said.recorded, newest.first_run) - 1
          AS before
      FROM {recordings} AS newest CROSS JOIN run AS its CROSS JOIN run AS said
      WHERE its.run = newest.run AND said.run = newest.said_by
    ) AS counted
    WHERE counted.before <= COALESCE(
      (SELECT CAST(value AS BIGINT) FROM fact WHERE name = 'retest_most'), counted.before)
    ORDER BY
      counted.is_given_up,
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'best' THEN
        CASE counted.verdict
          WHEN 'PASS' THEN 0 WHEN 'NO_LIMITS' THEN 1 WHEN 'FAIL' THEN 2 ELSE 3
        END
      END,
      CASE WHEN (SELECT value FROM fact WHERE name = 'retest_counts') = 'first' THEN
        counted.before
      END,
      counted.before DESC
    LIMIT 1
  );
)sql";

/// For a run `own` of `measured`, the last decision that states whether the serial number of its
/// recording was wrong.
constexpr std::string_view kSaidOfSerial =
    "(SELECT max(one.disposition) FROM run AS its CROSS JOIN disposition AS one CROSS JOIN "
    "measured AS same WHERE its.serial = own.serial AND one.run = its.run AND one.wrong_serial IS "
    "NOT NULL AND same.run = its.run AND same.first_run = own.first_run)";

/// Within `standing`: whether the recording of a run `own` was given up, as in `given_up`.
constexpr std::string_view kIsGivenUp =
    "EXISTS (SELECT 1 FROM disposition AS said WHERE said.wrong_serial = 1 AND said.disposition = "
    "{said_of_serial})";

/// For a unit within `standing`: the first and the newest run of each recording, and the run that
/// states its time of measurement.
constexpr std::string_view kRecordings =
    "(SELECT first_run, max(run) AS run, COALESCE(max(CASE WHEN recorded_by = 'list' THEN run "
    "END), first_run) AS said_by, {is_given_up} AS is_given_up FROM measured AS own WHERE "
    "own.serial = unit.serial GROUP BY serial, first_run)";

/// For the current run within `standing`, the run that states the recording's time of measurement.
constexpr std::string_view kSaidBy =
    "(SELECT its.said_by FROM {recordings} AS its WHERE its.run = run.run)";

/// The columns of `run` as `standing` selects them.
std::string StandingRunColumns() {
  std::string columns;
  const UnitRun none;
  Fields(
      [&columns](const std::string& name, const auto&) {
        columns += columns.empty() ? "" : ", ";
        columns += name.starts_with("recorded") ? "(SELECT timed." + name +
                                                      " FROM run AS timed WHERE timed.run = "
                                                      "{said_by}) AS " +
                                                      name
                                                : "run." + name;
      },
      none);
  return columns;
}

/// The values of a row: `values`, then those of a struct.
template <typename Thing>
std::vector<Value> ValuesOf(const Thing& thing, std::vector<Value> values = {}) {
  Fields(RowWriter{&values}, thing);
  return values;
}

/// One row for each item: the name of the run, the number of the item from 1, and its fields.
template <typename Items>
TableRows RowsOfItems(std::string_view table, const UnitRun& run, const Items& items) {
  TableRows rows{table, {}};
  std::int64_t place = 0;
  for (const auto& item : items) {
    rows.rows.push_back(ValuesOf(item, {std::string_view(run.id), ++place}));
  }
  return rows;
}

TableRows RowsOfFindings(const UnitRun& run) {
  TableRows rows{"finding", {}};
  for (const Finding& finding : run.findings) {
    const Json json = ToTree(finding);
    std::vector<Value>& row = rows.rows.emplace_back();
    row = {std::string_view(run.id), std::int64_t{std::ssize(rows.rows)}};
    for (const std::string_view column : kFindingColumns) {
      const auto member = json.find(column);
      if (member == json.end()) {
        row.emplace_back();
      } else if (member->is_number_integer()) {
        row.emplace_back(member->get<std::int64_t>());
      } else {
        row.emplace_back(member->is_string()
                             ? member->get<std::string>()
                             : member->dump(-1, ' ', false, Json::error_handler_t::replace));
      }
    }
  }
  return rows;
}

TableRows RowsOfTags(const UnitRun& run) {
  TableRows rows{"tag", {}};
  TagFields(
      [&](std::string_view name, const std::string& value) {
        if (!value.empty()) rows.rows.push_back({run.id, name, value});
      },
      run.tags);
  return rows;
}

/// "name {text} NOT NULL, …" for the columns of a struct.
template <typename Thing>
std::string DefinitionsOf() {
  std::string sql;
  const Thing none{};
  Fields(
      [&sql]<typename Field>(const char* name, const Field&) {
        sql.append("  ").append(name);
        if constexpr (std::is_same_v<Field, double> ||
                      std::is_same_v<Field, std::optional<double>>) {
          sql += " {real},\n";
        } else if constexpr (std::is_same_v<Field, std::vector<double>>) {
          sql += " {bytes},\n";
        } else if constexpr (std::is_same_v<Field, std::optional<bool>>) {
          sql += " BIGINT,\n";
        } else if constexpr (std::is_arithmetic_v<Field>) {
          sql += " BIGINT NOT NULL,\n";
        } else {
          sql += " {text} NOT NULL,\n";
        }
      },
      none);
  return sql;
}

std::string TableSql(std::string_view name, const std::string& columns, std::string_view keys) {
  return std::string("CREATE TABLE ").append(name) + " (\n" + columns + "  " + std::string(keys) +
         "\n);\n";
}

constexpr std::string_view kOfRun = "FOREIGN KEY (run) REFERENCES run (run), ";

/// The statement that creates a table of runs' items, such as inputs or parameters.
std::string PartSql(std::string_view name, const std::string& columns) {
  return TableSql(name,
                  "  run {text} NOT NULL,\n  place BIGINT NOT NULL,\n" + columns,
                  std::string(kOfRun) + "PRIMARY KEY (run, place)");
}

constexpr char kFindingDefinitions[] =
    "  code {text} NOT NULL,\n  severity {text} NOT NULL,\n  sensor {text},\n  axis {text},\n"
    "  pose BIGINT,\n  text {text} NOT NULL,\n  remedy {text},\n  \"values\" {text},\n"
    "  treatment {text},\n";

}  // namespace

std::vector<TableRows> RowsOf(const UnitRun& run) {
  return {{"unit", {{run.serial}}},
          {kRunTable, {ValuesOf(run)}},
          RowsOfTags(run),
          RowsOfItems("input", run, run.inputs),
          RowsOfItems("reading", run, run.readings),
          RowsOfItems("parameter", run, run.parameters),
          RowsOfFindings(run),
          RowsOfItems("judgement", run, run.judgements)};
}

TableRows RowOf(const Disposition& disposition) { return {"disposition", {ValuesOf(disposition)}}; }
TableRows RowOf(const StationCheck& check) { return {"station_check", {ValuesOf(check)}}; }

std::string InsertStatement(std::string_view table, std::size_t columns, std::size_t rows) {
  std::string sql = "INSERT INTO ";
  sql.append(table).append(" VALUES ");
  std::size_t number = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      sql += column > 0 ? ", $" : row > 0 ? "), ($" : "($";
      sql += std::to_string(++number);
    }
  }
  return sql + ") ON CONFLICT DO NOTHING";
}

std::string TablesSql(const TypeNames& types) {
  std::string sql =
      TableSql("unit", "  serial {text} NOT NULL,\n", "PRIMARY KEY (serial)") +
      TableSql(kRunTable,
               DefinitionsOf<UnitRun>(),
               "PRIMARY KEY (run), FOREIGN KEY (serial) REFERENCES unit (serial)") +
      TableSql("tag",
               "  run {text} NOT NULL,\n  name {text} NOT NULL,\n  value {text} NOT NULL,\n",
               std::string(kOfRun) + "PRIMARY KEY (run, name)") +
      PartSql("input", DefinitionsOf<InputFile>()) +
      PartSql("reading", DefinitionsOf<SensorReadings>()) +
      PartSql("parameter", DefinitionsOf<Parameter>()) + PartSql("finding", kFindingDefinitions) +
      PartSql("judgement", DefinitionsOf<LimitCheck>()) +
      TableSql("disposition",
               DefinitionsOf<Disposition>(),
               std::string(kOfRun) + "PRIMARY KEY (disposition)") +
      TableSql("station_check", DefinitionsOf<StationCheck>(), "PRIMARY KEY (station_check)") +
      TableSql(
          "fact", "  name {text} NOT NULL,\n  value {text} NOT NULL,\n", "PRIMARY KEY (name)") +
      std::string(kViews) + "INSERT INTO fact VALUES ('" + std::string(kSchemaVersionName) +
      "', '" + std::to_string(kSchemaVersion) + "'), ('" + std::string(kStoreFact) + "', '" +
      NewRunId() + "');\n";
  const std::string run_columns = StandingRunColumns();
  for (const auto& [from, to] :
       {std::pair<std::string_view, std::string_view>{"{run_columns}", run_columns},
        {"{said_by}", kSaidBy},
        {"{recordings}", kRecordings},
        {"{is_given_up}", kIsGivenUp},
        {"{said_of_serial}", kSaidOfSerial},
        {"{text}", types.text},
        {"{real}", types.real},
        {"{bytes}", types.bytes}}) {
    for (std::size_t at = 0; (at = sql.find(from, at)) != std::string::npos; at += to.size()) {
      sql.replace(at, from.size(), to);
    }
  }
  return sql;
}

Status CheckSchemaVersion(const std::string& name, const std::string& found) {
  if (found == std::to_string(kSchemaVersion)) return {};
  return Error(
      ErrorCode::kStoreFailure,
      {name},
      (found.empty() ? "states no version of its schema" : "has the schema of version " + found) +
          ", but this program reads and writes version " + std::to_string(kSchemaVersion) +
          "; use the truetriad that wrote it, or calibrate its logs into a new store");
}

std::vector<double> RealsFromHex(std::string_view digits) {
  constexpr std::size_t kDigits = 16;  // 8 bytes of a double.
  std::vector<double> reals;
  reals.reserve(digits.size() / kDigits);
  for (; digits.size() >= kDigits; digits.remove_prefix(kDigits)) {
    std::uint64_t bits = 0;
    for (std::size_t byte = kDigits; byte > 0; byte -= 2) {
      unsigned value = 0;
      std::from_chars(digits.data() + byte - 2, digits.data() + byte, value, 16);
      bits = bits << 8U | value;
    }
    reals.push_back(std::bit_cast<double>(bits));
  }
  return reals;
}

std::string HexOf(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const unsigned char byte : bytes) text += {kDigits[byte >> 4], kDigits[byte & 15U]};
  return text;
}

}  // namespace truetriad::fleet
