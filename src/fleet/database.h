// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "fleet/fields.h"
#include "fleet/store.h"
#include "formats/number_text.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A connection to a database with the tables of TablesSql, implemented for SQLite and for
/// PostgreSQL. All functions: error (bad input) if the database cannot be reached, read or written.
class Database {
 public:
  virtual ~Database() = default;

  /// The database's name for messages, without a password.
  virtual const std::string& name() const = 0;
  /// How many rows one statement should insert at most.
  virtual std::size_t rows_at_once() const = 0;

  /// Runs `work` in one transaction, which is on disk on return; an error undoes all of it. If the
  /// connection is lost, it is reopened and `work` is called again. Calls must not be nested.
  virtual Status Transact(Access access, const std::function<Status()>& work) = 0;
  /// Runs a statement and returns the number of inserted rows. To be called only in `work` of
  /// Transact.
  virtual Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) = 0;
  /// Returns the rows of a query. To be called only in `work` of Transact.
  virtual Result<Table> Ask(std::string_view sql, std::span<const Value> values) = 0;
  /// Returns the rows of a query that a user typed. Must not be called in `work` of Transact. Error
  /// (usage): the text is not valid SQL, not one statement, or would change the database.
  virtual Result<Table> AskAsGiven(const std::string& sql) = 0;
  /// As Store::AllowTypedText. Must not be called in `work` of Transact.
  virtual Status AllowTypedText() { return {}; }
  /// As Store::TellNotes.
  virtual void TellNotes(std::function<void(const std::string&)> /*on_note*/) {}
};

/// Opens an SQLite file, with write-ahead log and `synchronous=FULL`. Errors as OpenStore.
Result<std::unique_ptr<Database>> OpenSqlite(const std::string& path, Access access);
/// Opens a temporary SQLite database, deleted with the object. `name` is for messages.
Result<std::unique_ptr<Database>> OpenPassingSqlite(const std::string& name);

/// The name ("NFS") of the network file system that has `magic` as `f_type` in statfs; SQLite's
/// locks fail there. Empty: it is another kind of file system.
std::string_view NetworkFileSystemName(long magic);

/// Connects to a PostgreSQL server; the tables are in the schema in which the server creates new
/// tables. If the connection is lost later, it is reopened and its transaction repeated for up to
/// the number of seconds in the environment variable TRUETRIAD_STORE_PATIENCE (default 60). Errors
/// as OpenStore.
Result<std::unique_ptr<Database>> OpenPostgres(const std::string& url, Access access);

// Functions that SQLite and PostgreSQL share; statements have parameters $1, $2, … in order.

/// The rows of a run in all tables: the unit, the run, and then its parts, which refer to the run.
/// A database has all parts of a run or none. The rows are valid as long as `run` is.
std::vector<TableRows> RowsOf(const UnitRun& run);
TableRows RowOf(const Disposition& disposition);
TableRows RowOf(const StationCheck& check);

/// Doubles from the hexadecimal digits of their bytes, the least significant byte first.
std::vector<double> RealsFromHex(std::string_view digits);
/// Bytes as hexadecimal digits, "0a1f…".
std::string HexOf(std::span<const unsigned char> bytes);

/// Appends fields to a row; the row does not own their text.
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
    } else {  // The field is optional.
      values->push_back(field ? Value(*field) : Value());
    }
  }
};

/// Reads fields from the cells of a row, beginning at `at`; NULL leaves a field unchanged.
struct RowReader {
  std::span<const Cell> row;
  std::size_t at = 0;
  std::string odd_verdict = {};  ///< The last unknown verdict; empty: none.

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
    } else if constexpr (std::is_same_v<Field, bool> ||
                         std::is_same_v<Field, std::optional<bool>>) {
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

/// Reads a struct from a row. If a verdict is unknown, its field keeps the default.
template <typename Thing>
Thing FromRow(std::span<const Cell> row, std::size_t at = 0) {
  Thing thing{};
  Fields(RowReader{row, at}, thing);
  return thing;
}

/// A struct's columns, "name, value, sigma"; "t.name, …" if `table` is "t".
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
/// The columns of findings, named like the members of their JSON. `values` contains JSON, too.
inline constexpr std::array<std::string_view, 9> kFindingColumns = {
    "code", "severity", "sensor", "axis", "pose", "text", "remedy", "values", "treatment"};
inline constexpr std::string_view kFindingSelected =
    "code, severity, sensor, axis, pose, text, remedy, \"values\", treatment";
/// The name of the entry in StoreFacts that identifies a store.
inline constexpr std::string_view kStoreFact = "store";
/// Names of column types, which differ between SQLite and PostgreSQL.
struct TypeNames {
  std::string_view text, real, bytes;
};
/// The statements that create tables, indices and views.
std::string TablesSql(const TypeNames& types);

}  // namespace truetriad::fleet
