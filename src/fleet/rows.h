// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fleet/store.h"
#include "fleet/unit_run.h"

namespace truetriad::fleet {

// What SQLite and PostgreSQL have in common: statements with $1, $2, … in their order.

/// A value of a row: NULL, text, numbers, or bytes. Only std::string owns what it says.
using Value = std::variant<std::monostate,
                           std::string_view,
                           std::string,
                           std::int64_t,
                           double,
                           const std::vector<double>*>;

/// Rows to be inserted into one table, unless they are there.
struct TableRows {
  std::string_view table;
  std::size_t columns = 0;
  std::vector<Value> values;  ///< Row by row.
};

/// Of all tables the rows of a run, in an order that references allow: the unit, the run, and what
/// belongs to it, which is there where the run is. Valid as long as `run`.
std::vector<TableRows> RowsOf(const UnitRun& run);
TableRows RowOf(const Disposition& disposition);
TableRows RowOf(const StationCheck& check);
TableRows FactRow(std::string_view name, std::string_view value);

/// INSERT INTO table VALUES ($1, $2), ($3, $4) ON CONFLICT DO NOTHING.
std::string InsertStatement(std::string_view table, std::size_t columns, std::size_t rows);

inline constexpr std::string_view kRunTable = "run";
/// The fact that is a store's identity.
inline constexpr std::string_view kStoreFact = "store";
/// Of each log the last run, from the log after $1 on, some at a time: of a million they need not
/// all be here at once. A row for each of its tags, or one.
inline constexpr std::string_view kLastRuns =
    "SELECT log, log_bytes, log_modified_ns, config_sha256, software, verdict, serial, tag.name, "
    "tag.value, code, recorded FROM (SELECT run, log, log_bytes, log_modified_ns, config_sha256, "
    "software, "
    "verdict, "
    "serial, code, recorded FROM run AS one WHERE log > $1 AND NOT EXISTS (SELECT 1 FROM run AS "
    "later WHERE "
    "later.log = one.log AND later.run > one.run) ORDER BY log LIMIT 10000) AS last "
    "LEFT JOIN tag ON tag.run = last.run ORDER BY log";
inline constexpr std::string_view kFactsOf = "SELECT value FROM fact WHERE name = $1";
inline constexpr std::string_view kStandingRun =
    "SELECT run, verdict FROM standing WHERE serial = $1";
inline constexpr std::string_view kFoldersOfUnit =
    "SELECT run, folder, verdict FROM run WHERE serial = $1 AND folder <> '' ORDER BY run";
inline constexpr std::string_view kUnitsHeldBack =
    "SELECT serial FROM standing WHERE disposed_by <> '' OR (final_verdict IN ('FAIL', "
    "'NO_RESULT') "
    "AND EXISTS (SELECT 1 FROM run WHERE run.serial = standing.serial AND run.run <> "
    "standing.run AND run.verdict <> 'NO_RESULT' AND run.folder <> '')) ORDER BY serial";
inline constexpr std::string_view kLastRunOfUnit = "SELECT max(run) FROM run WHERE serial = $1";
inline constexpr std::string_view kStandingOf =
    "SELECT run, first_verdict, final_verdict, attempts, disposed_by, disposed_why, "
    "(SELECT value FROM fact WHERE name = 'retest_most'), (SELECT max(disposition.created) FROM "
    "disposition JOIN run ON run.run = disposition.run WHERE run.serial = $1) FROM standing WHERE "
    "serial = $1";
inline constexpr std::string_view kLatestRun =
    "SELECT max(run) FROM (SELECT max(run) AS run FROM run WHERE serial = $1 UNION ALL "
    "SELECT max(run) FROM run WHERE log = $2 UNION ALL "
    "SELECT max(disposition) FROM run AS its CROSS JOIN disposition "
    "WHERE its.serial = $1 AND disposition.run = its.run) AS either";
/// Runs not of the unit $1 nor of the log $2 that were made from all `files` with samples: $3, ….
std::string RunsOfSameReadings(std::size_t files);
inline constexpr std::string_view kDispositions =
    "SELECT disposition, serial, disposition.created, who, why, disposition.verdict, "
    "disposition.run FROM disposition JOIN run ON run.run = disposition.run ORDER BY disposition";
inline constexpr std::string_view kStationChecks =
    "SELECT station_check, station, serial, created, agrees, p, largest, parameter, log, "
    "recording, repeatability FROM station_check ORDER BY station_check";
/// Of checks that are called `one`: those that count. A recording that was checked again does not.
inline const std::string kChecksThatCount =
    "station_check AS one WHERE (recording = '' OR NOT EXISTS (SELECT 1 FROM station_check AS "
    "prior WHERE prior.station = one.station AND prior.recording = one.recording AND "
    "prior.station_check < one.station_check))";
inline const std::string kLastStationCheck =
    "SELECT station_check, station, serial, created, agrees, p, largest, parameter, log, "
    "recording, repeatability FROM " +
    kChecksThatCount + " AND station = $1 ORDER BY station_check DESC LIMIT 1";
inline constexpr std::string_view kFirstCheckOfRecording =
    "SELECT station_check, station, serial, created, agrees, p, largest, parameter, log, "
    "recording, repeatability FROM station_check WHERE station = $1 AND recording = $2 "
    "ORDER BY station_check LIMIT 1";

/// Names of types where the two differ.
struct TypeNames {
  std::string_view text, real, bytes;
};
/// What takes a store of `version` to that of this program.
std::string MigrationsFrom(std::int64_t version, const TypeNames& types);

/// Error (bad input): `version` is later than this program's.
Status CheckSchemaVersion(const std::string& store, std::int64_t version);

/// Error (usage): the store `name` is of `there` shards, and not of `stated`.
Status CheckShards(const std::string& name, std::int64_t there, std::int64_t stated);

/// The shortest text that reads back to the same number.
std::string ShortestText(double number);
/// "0a1f…".
std::string HexOf(std::span<const unsigned char> bytes);

}  // namespace truetriad::fleet
