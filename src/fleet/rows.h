// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "fleet/fields.h"
#include "fleet/store.h"

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

/// The shortest text that reads back to the same number.
std::string ShortestText(double number);
/// Doubles from the digits of their bytes, the least significant first.
std::vector<double> RealsFromHex(std::string_view digits);
/// "0a1f…".
std::string HexOf(std::span<const unsigned char> bytes);

/// Appends fields to a row; text is not owned.
struct RowWriter {
  std::vector<Value>* values;

  template <typename Field>
  void operator()(std::string_view /*name*/, const Field& field) const {
    if constexpr (std::is_convertible_v<Field, std::string_view>) {
      values->emplace_back(std::string_view(field));
    } else if constexpr (std::is_same_v<Field, Verdict>) {
      values->emplace_back(VerdictName(field));
    } else if constexpr (std::is_same_v<Field, std::vector<double>>) {
      values->push_back(field.empty() ? Value() : Value(&field));
    } else if constexpr (std::is_same_v<Field, double>) {
      values->push_back(std::isfinite(field) ? Value(field) : Value());
    } else if constexpr (std::is_same_v<Field, bool> || std::is_same_v<Field, std::int64_t>) {
      values->emplace_back(std::int64_t{field});
    } else {  // Optional.
      values->push_back(field ? Value(*field) : Value());
    }
  }
};

/// Reads fields from the cells of a row, from `at` on; NULL leaves a field as it was.
struct RowReader {
  std::span<const Cell> row;
  std::size_t at = 0;
  std::string odd_verdict = {};  ///< A verdict that is none.

  template <typename Field>
  void operator()(std::string_view /*name*/, Field& field) {
    const Cell& cell = row[at++];
    if (!cell) return;
    if constexpr (std::is_same_v<Field, Verdict>) {
      if (const std::optional<Verdict> verdict = VerdictFromName(*cell)) {
        field = *verdict;
      } else {
        odd_verdict = *cell;
      }
    } else if constexpr (std::is_same_v<Field, std::vector<double>>) {
      field = RealsFromHex(*cell);
    } else if constexpr (std::is_same_v<Field, bool>) {
      field = *cell != "0";
    } else if constexpr (std::is_assignable_v<Field&, const std::string&>) {
      field = *cell;
    } else if constexpr (std::is_arithmetic_v<Field>) {
      field = NumberOf(cell, field);
    } else {
      field = NumberOf(cell, typename Field::value_type());
    }
  }
};

/// A thing from a row; of an odd verdict what it was made with.
template <typename Thing>
Thing FromRow(std::span<const Cell> row, std::size_t at = 0) {
  Thing thing{};
  Fields(RowReader{row, at}, thing);
  return thing;
}

/// "name, value, sigma"; with a table before each, where one is named.
template <typename Thing>
std::string ColumnsOf(const std::string& table = "") {
  std::string columns;
  const Thing none{};
  Fields(
      [&](const char* name, const auto&) {
        columns += (columns.empty() ? "" : ", ") + (table.empty() ? "" : table + ".") + name;
      },
      none);
  return columns;
}

/// INSERT INTO table VALUES ($1, $2), ($3, $4) ON CONFLICT DO NOTHING.
std::string InsertStatement(std::string_view table, std::size_t columns, std::size_t rows);

inline constexpr std::string_view kRunTable = "run";
/// The fact that is a store's identity.
inline constexpr std::string_view kStoreFact = "store";
inline constexpr std::string_view kFactsOf = "SELECT value FROM fact WHERE name = $1";
inline constexpr std::string_view kUnitsHeldBack =
    "SELECT serial FROM standing WHERE disposed_by <> '' OR (final_verdict IN ('FAIL', "
    "'NO_RESULT') "
    "AND EXISTS (SELECT 1 FROM run WHERE run.serial = standing.serial AND run.run <> "
    "standing.run AND run.verdict <> 'NO_RESULT' AND run.folder <> '')) ORDER BY serial";
inline constexpr std::string_view kLatestRun =
    "SELECT max(run) FROM (SELECT max(run) AS run FROM run WHERE serial = $1 UNION ALL "
    "SELECT max(run) FROM run WHERE log = $2 UNION ALL "
    "SELECT max(disposition) FROM run AS its CROSS JOIN disposition "
    "WHERE its.serial = $1 AND disposition.run = its.run) AS either";
/// Runs not of the unit $1 nor of the log $2 that were made from all `files` with samples: $3, ….
std::string RunsOfSameReadings(std::size_t files);
/// Of checks that are called `one`: those that count. A recording that was checked again does not.
inline const std::string kChecksThatCount =
    "station_check AS one WHERE (recording = '' OR NOT EXISTS (SELECT 1 FROM station_check AS "
    "prior WHERE prior.station = one.station AND prior.recording = one.recording AND "
    "prior.station_check < one.station_check))";
/// Names of types where the two differ.
struct TypeNames {
  std::string_view text, real, bytes;
};
/// The statements that make the tables, indices and views.
std::string TablesSql(const TypeNames& types);

/// Error (usage): of the store `name` another policy was stated.
Status CheckPolicy(const std::string& name, const RetestPolicy& there, const RetestPolicy& stated);
/// Error (usage): the store `name` is of `there` shards, and not of `stated`.
Status CheckShards(const std::string& name, std::int64_t there, std::int64_t stated);

}  // namespace truetriad::fleet
