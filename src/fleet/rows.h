// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// What SQLite and PostgreSQL have in common: statements with $1, $2, … in their order.

/// A value of a row: NULL, text, numbers, or bytes; it does not own what it points to.
using Value = std::
    variant<std::monostate, std::string_view, std::int64_t, double, const std::vector<double>*>;

/// One row to be inserted by a statement of this program, unless it is there.
struct Row {
  std::string_view sql;
  std::vector<Value> values;
  bool is_run = false;  ///< Where this is there already, all that follows is, too.
};

/// All rows of a run, in an order that references allow. Valid as long as `run`.
std::vector<Row> RowsOf(const UnitRun& run);

inline constexpr std::string_view kLastRuns =
    "SELECT log, log_bytes, log_modified_ns, config_sha256, software, verdict FROM run AS one "
    "WHERE NOT EXISTS (SELECT 1 FROM run AS later WHERE later.log = one.log AND "
    "later.run > one.run)";
inline constexpr std::string_view kInsertFact =
    "INSERT INTO fact VALUES ($1, $2) ON CONFLICT DO NOTHING";
inline constexpr std::string_view kShards = "SELECT value FROM fact WHERE name = 'shards'";

/// Names of types where the two differ.
struct TypeNames {
  std::string_view real, bytes;
};
/// What takes a store of `version` to the next.
std::string MigrationFrom(int version, const TypeNames& types);

/// Error (bad input): `version` is later than this program's.
Status CheckSchemaVersion(const std::string& store, std::int64_t version);
/// Error (usage): the store is of `there` shards, and not of `stated`.
Status CheckShards(const std::string& store, const std::string& there, const std::string& stated);

/// The shortest text that reads back to the same number.
std::string ShortestText(double number);
/// "0a1f…".
std::string HexOf(std::span<const unsigned char> bytes);

}  // namespace truetriad::fleet
