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

/// A connection to a database that has the tables of TablesSql: what SQLite and PostgreSQL do each
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

/// One file, with write-ahead log and `synchronous=FULL`. Errors as OpenStore.
Result<std::unique_ptr<Database>> OpenSqlite(const std::string& path, Access access);
/// One that nobody else sees, and that is gone with the object; `name`: for messages.
Result<std::unique_ptr<Database>> OpenPassingSqlite(const std::string& name);

/// "NFS" of statfs' `f_type`: a file system on which SQLite's locks do not hold. Else empty.
std::string_view NetworkFileSystemName(long magic);

/// A PostgreSQL server, in the schema where its connection makes tables. A connection that is lost
/// later on is opened anew, and what it was about repeated, for as many seconds as the environment
/// variable TRUETRIAD_STORE_PATIENCE says, 60 if it does not. Errors as OpenStore.
Result<std::unique_ptr<Database>> OpenPostgres(const std::string& url, Access access);

// What SQLite and PostgreSQL have in common: statements with $1, $2, … in their order.

/// Of all tables the rows of a run, in an order that references allow: the unit, the run, and what
/// belongs to it, which is there where the run is. Valid as long as `run`.
std::vector<TableRows> RowsOf(const UnitRun& run);
TableRows RowOf(const Disposition& disposition);
TableRows RowOf(const StationCheck& check);

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
/// The columns of findings, which are the members of their JSON; `values` is JSON, too.
inline constexpr std::array<std::string_view, 9> kFindingColumns = {
    "code", "severity", "sensor", "axis", "pose", "text", "remedy", "values", "treatment"};
inline constexpr std::string_view kFindingSelected =
    "code, severity, sensor, axis, pose, text, remedy, \"values\", treatment";
/// The fact that is a store's identity.
inline constexpr std::string_view kStoreFact = "store";
/// Names of types where the two differ.
struct TypeNames {
  std::string_view text, real, bytes;
};
/// The statements that make the tables, indices and views.
std::string TablesSql(const TypeNames& types);

}  // namespace truetriad::fleet
