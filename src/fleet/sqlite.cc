// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>

#include <sqlite3.h>
#include <sys/vfs.h>

#include "base/spelling.h"
#include "fleet/database.h"

namespace truetriad::fleet {
namespace {

constexpr int kApplicationId = 0x74726674;  // "trft", the identity of this program's files.
constexpr int kPatienceMs = 30'000;         // Longest wait for another writer.

static_assert(std::endian::native == std::endian::little);

using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

void Bind(sqlite3_stmt* statement, int place, const Value& value) {
  std::visit(
      [&](const auto& stated) {
        using Stated = std::decay_t<decltype(stated)>;
        if constexpr (std::is_same_v<Stated, std::monostate>) {
          sqlite3_bind_null(statement, place);
        } else if constexpr (std::is_same_v<Stated, std::int64_t>) {
          sqlite3_bind_int64(statement, place, stated);
        } else if constexpr (std::is_same_v<Stated, double>) {
          sqlite3_bind_double(statement, place, stated);
        } else if constexpr (std::is_same_v<Stated, const std::vector<double>*>) {
          sqlite3_bind_blob64(
              statement, place, stated->data(), stated->size() * sizeof(double), SQLITE_TRANSIENT);
        } else {
          const int size = static_cast<int>(stated.size());
          sqlite3_bind_text(statement, place, stated.data(), size, SQLITE_TRANSIENT);
        }
      },
      value);
}

class SqliteDatabase : public Database {
 public:
  explicit SqliteDatabase(std::string path) : path_(std::move(path)) {}

  /// Opens the file; for writing, also creates tables. `is_passing`: opens a temporary database.
  Status Open(Access access, bool is_passing = false) {
    const bool to_read = access == Access::kRead;
    const int flags = to_read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    // Names like :memory: have a special meaning for SQLite; absolute paths have none.
    const std::string whole = is_passing ? "" : std::filesystem::absolute(path_).string();
    sqlite3* opened = nullptr;
    const int code = sqlite3_open_v2(whole.c_str(), &opened, flags, nullptr);
    database_.reset(opened);
    if (code != SQLITE_OK) return Failure();
    sqlite3_busy_timeout(opened, kPatienceMs);
    sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t tables,
                               Number("SELECT count(*) FROM sqlite_master"));
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t application, Number("PRAGMA application_id"));
    if (application != kApplicationId && (tables > 0 || to_read)) {
      return Error(ErrorCode::kStoreFailure,
                   {path_},
                   "is a database that truetriad has not written; name another file");
    }
    if (!to_read) {
      TRUETRIAD_RETURN_IF_ERROR(Execute("PRAGMA journal_mode = WAL"));
      TRUETRIAD_RETURN_IF_ERROR(Execute("PRAGMA synchronous = FULL"));
      TRUETRIAD_RETURN_IF_ERROR(Execute("PRAGMA foreign_keys = ON"));
      // The first process creates the tables; the others wait for it and then find them.
      TRUETRIAD_RETURN_IF_ERROR(Transact(access, [&] { return MakeTables(); }));
    }
    return {};
  }

  const std::string& name() const override { return path_; }
  std::size_t rows_at_once() const override { return 1; }

  Status Transact(Access access, const std::function<Status()>& work) override {
    TRUETRIAD_RETURN_IF_ERROR(Execute(access == Access::kRead ? "BEGIN" : "BEGIN IMMEDIATE"));
    Status status = work();
    if (status) status = Execute("COMMIT");
    // After some failures SQLite has already rolled back; then this fails, which does no harm.
    if (!status) sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    return status;
  }

  Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(sqlite3_stmt* const statement, Prepared(sql, values));
    const int code = sqlite3_step(statement);
    sqlite3_reset(statement);
    if (code != SQLITE_DONE) return Failure();
    return std::int64_t{sqlite3_changes(database_.get())};
  }

  Result<Table> Ask(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(sqlite3_stmt* const statement, Prepared(sql, values));
    Result<Table> table = TableOf(statement);
    sqlite3_reset(statement);
    return table;
  }

  Result<Table> AskAsGiven(const std::string& sql) override {
    if (sql.find('\0') != std::string::npos) {
      return Error(ErrorCode::kInvalidArgument,
                   "the query contains a NUL, which SQL does not allow");
    }
    sqlite3_stmt* prepared = nullptr;
    const char* rest = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &prepared, &rest) != SQLITE_OK) {
      const std::string why = sqlite3_errmsg(database_.get());
      return Error(ErrorCode::kInvalidArgument, "the query is not valid: " + why + Suggestion(why));
    }
    const Statement statement(prepared, sqlite3_finalize);
    if (prepared == nullptr || sqlite3_stmt_readonly(prepared) == 0 ||
        std::string_view(rest).find_first_not_of(" \t\r\n;") != std::string_view::npos) {
      return Error(ErrorCode::kInvalidArgument,
                   "only a single statement that reads is allowed: SELECT …");
    }
    return TableOf(prepared);
  }

 private:
  /// A hint at the table or column that an unknown name may stand for. Empty: `complaint` is not
  /// about a name.
  std::string Suggestion(std::string_view complaint) {
    constexpr std::string_view kTables =
        "SELECT name FROM sqlite_master WHERE type IN ('table', "
        "'view') AND name NOT LIKE 'sqlite%' ORDER BY name";
    constexpr std::string_view kColumns =
        "SELECT DISTINCT its.name FROM sqlite_master AS one, pragma_table_info(one.name) AS its "
        "WHERE one.type IN ('table', 'view') ORDER BY its.name";
    for (const auto& [beginning, question] :
         {std::pair<std::string_view, std::string_view>{"no such table: ", kTables},
          {"no such column: ", kColumns}}) {
      if (!complaint.starts_with(beginning)) continue;
      const Result<Table> found = Ask(question, {});
      if (!found) return "";
      std::vector<std::string_view> known;
      for (const auto& row : found->rows) known.emplace_back(*row[0]);
      if (question == kColumns) {
        for (const std::string_view tag : TagNames()) known.push_back(tag);
      }
      const std::string_view word = complaint.substr(beginning.size());
      // Only the column of `one.serial` is compared; without a dot, npos + 1 is 0.
      const std::string near = DidYouMean(word.substr(word.rfind('.') + 1), known);
      return near.empty() ? "; docs/fleet.md has the tables and their columns" : near;
    }
    return "";
  }

  Error Failure() const {
    if (database_ == nullptr) return Error(ErrorCode::kStoreFailure, {path_}, "out of memory");
    const int code = sqlite3_errcode(database_.get());
    const int reason = code == SQLITE_IOERR ? sqlite3_system_errno(database_.get()) : 0;
    std::string text = sqlite3_errmsg(database_.get());
    if (reason != 0) text += std::string(": ") + std::strerror(reason);
    if (code == SQLITE_FULL || reason == ENOSPC) {
      text += "; free disk space, and continue with --resume";
    }
    return Error(ErrorCode::kStoreFailure, {path_}, text);
  }

  Result<Table> TableOf(sqlite3_stmt* statement) const {
    Table table;
    const int columns = sqlite3_column_count(statement);
    for (int i = 0; i < columns; ++i) table.columns.emplace_back(sqlite3_column_name(statement, i));
    table.are_numbers.assign(table.columns.size(), true);
    table.are_bytes.assign(table.columns.size(), true);
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(statement)) == SQLITE_ROW) {
      std::vector<Cell> row;
      for (int i = 0; i < columns; ++i) row.push_back(TextOf(statement, i, &table));
      table.rows.push_back(std::move(row));
    }
    if (code != SQLITE_DONE) return Failure();
    return table;
  }

  static std::optional<std::string> TextOf(sqlite3_stmt* row, int column, Table* table) {
    const int type = sqlite3_column_type(row, column);
    if (type == SQLITE_NULL) return std::nullopt;
    if (type != SQLITE_BLOB) table->are_bytes[static_cast<std::size_t>(column)] = false;
    if (type == SQLITE_FLOAT) return NumberText(sqlite3_column_double(row, column));
    if (type != SQLITE_INTEGER) table->are_numbers[static_cast<std::size_t>(column)] = false;
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, column));
    if (type == SQLITE_BLOB) {
      return HexOf({static_cast<const unsigned char*>(sqlite3_column_blob(row, column)), size});
    }
    return std::string(reinterpret_cast<const char*>(sqlite3_column_text(row, column)), size);
  }

  Status Execute(const std::string& sql) {
    const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
    return code == SQLITE_OK ? Status() : Status(Failure());
  }

  Result<std::int64_t> Number(std::string_view sql) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Ask(sql, {}));
    return NumberOf<std::int64_t>(table.rows.at(0).at(0), 0);
  }

  Status MakeTables() {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t tables,
                               Number("SELECT count(*) FROM sqlite_master"));
    if (tables > 0) return {};
    TRUETRIAD_RETURN_IF_ERROR(
        Execute(TablesSql({.text = "TEXT", .real = "REAL", .bytes = "BLOB"})));
    return Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  }

  /// The prepared statement with bound values.
  Result<sqlite3_stmt*> Prepared(std::string_view sql, std::span<const Value> values) {
    auto found = statements_.find(sql);
    if (found == statements_.end()) {
      sqlite3_stmt* prepared = nullptr;
      sqlite3_prepare_v3(database_.get(),
                         sql.data(),
                         static_cast<int>(sql.size()),
                         SQLITE_PREPARE_PERSISTENT,
                         &prepared,
                         nullptr);
      if (prepared == nullptr) return Failure();
      found = statements_.emplace(sql, Statement(prepared, sqlite3_finalize)).first;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      Bind(found->second.get(), static_cast<int>(i) + 1, values[i]);
    }
    return found->second.get();
  }

  std::string path_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> database_{nullptr, sqlite3_close};
  std::map<std::string, Statement, std::less<>> statements_;  ///< By their text.
};

}  // namespace

std::string_view NetworkFileSystemName(long magic) {
  // Magic numbers as in statfs(2) and the kernel's linux/magic.h.
  constexpr std::array<std::pair<unsigned long, std::string_view>, 10> kNetworks = {
      {{0x6969, "NFS"},
       {0x517B, "SMB"},
       {0xFF534D42, "SMB"},
       {0xFE534D42, "SMB"},
       {0x00C36400, "CephFS"},
       {0x0BD00BD0, "Lustre"},
       {0x47504653, "GPFS"},
       {0x19830326, "BeeGFS"},
       {0x5346414F, "AFS"},
       {0x01021997, "9P"}}};
  for (const auto& [known, name] : kNetworks) {
    if ((static_cast<unsigned long>(magic) & 0xFFFFFFFFUL) == known) return name;
  }
  return "";
}

Result<std::unique_ptr<Database>> OpenSqlite(const std::string& path, Access access) {
  namespace fs = std::filesystem;
  std::error_code failure;
  const bool to_read = access == Access::kRead;
  const fs::path folder = fs::absolute(path, failure).parent_path();
  struct statfs about {};
  if (statfs(folder.c_str(), &about) == 0) {
    const std::string_view network = NetworkFileSystemName(about.f_type);
    if (!network.empty() && !to_read) {
      return Error(ErrorCode::kStoreFailure,
                   {path},
                   "is on a network folder (" + std::string(network) +
                       "), where SQLite cannot keep two writers apart; use a local folder, a file "
                       "of its own for each shard (--store=shard-2.jsonl), or PostgreSQL "
                       "(--store=postgresql://…)");
    }
  }
  auto database = std::make_unique<SqliteDatabase>(path);
  TRUETRIAD_RETURN_IF_ERROR(database->Open(access));
  return std::unique_ptr<Database>(std::move(database));
}

Result<std::unique_ptr<Database>> OpenPassingSqlite(const std::string& name) {
  auto database = std::make_unique<SqliteDatabase>(name);
  TRUETRIAD_RETURN_IF_ERROR(database->Open(Access::kWrite, /*is_passing=*/true));
  return std::unique_ptr<Database>(std::move(database));
}

}  // namespace truetriad::fleet
