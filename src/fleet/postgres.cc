// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/companion.h"
#include "base/utf8.h"
#include "fleet/database.h"
#include "fleet/postgres_module.h"
#include "fleet/store.h"

namespace truetriad::fleet {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

/// Of the one lock under which tables are made: no other program's, hopefully.
constexpr std::int64_t kTablesLock = 0x7472'7566'7465'6574;

/// What PostgreSQL takes as text: UTF-8 without NUL; whatever else is in it becomes U+FFFD.
std::string StorableText(std::string_view text) {
  std::string storable;
  storable.reserve(text.size());
  while (!text.empty()) {
    const std::optional<Utf8Character> character = FirstCharacter(text);
    const std::size_t size = character ? character->size : 1;
    storable += character && character->code != 0 ? text.substr(0, size) : "\xEF\xBF\xBD";
    text.remove_prefix(size);
  }
  return storable;
}

std::optional<std::string> ParameterText(const Value& value) {
  return std::visit(
      [](const auto& stated) -> std::optional<std::string> {
        using Stated = std::decay_t<decltype(stated)>;
        if constexpr (std::is_same_v<Stated, std::monostate>) {
          return std::nullopt;
        } else if constexpr (std::is_same_v<Stated, std::int64_t>) {
          return std::to_string(stated);
        } else if constexpr (std::is_same_v<Stated, double>) {
          return ShortestText(stated);
        } else if constexpr (std::is_same_v<Stated, const std::vector<double>*>) {
          return "\\x" + HexOf({reinterpret_cast<const unsigned char*>(stated->data()),
                                stated->size() * sizeof(double)});
        } else {
          return StorableText(stated);
        }
      },
      value);
}

class PostgresDatabase : public Database {
 public:
  PostgresDatabase(const PostgresModule& module, std::string options, std::string name)
      : module_(module), options_(std::move(options)), name_(std::move(name)) {}

  /// Afterwards a lost connection is opened anew for that long.
  Status Open(Access access, Seconds patience) {
    bool has_tables = false;
    TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kRead, [&]() -> Status {
      TRUETRIAD_ASSIGN_OR_RETURN(has_tables, HasTables());
      return {};
    }));
    if (!has_tables && access == Access::kRead) {
      return Error(ErrorCode::kStoreFailure, {name_}, "has no tables that `fleet run` has made");
    }
    // Whoever comes first makes them; the others wait, and see what is done.
    if (!has_tables) {
      TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kWrite, [&] { return MakeTables(); }));
    }
    patience_ = patience;
    return {};
  }

  const std::string& name() const override { return name_; }
  // Each statement is a journey to the server and back; it takes 65535 values, and the widest table
  // has 21 columns.
  std::size_t rows_at_once() const override { return 1000; }

  Status Transact(Access access, const std::function<Status()>& work) override {
    constexpr Seconds kFirstPause(0.1), kLongestPause(5.0);
    const Clock::time_point begin = Clock::now();
    for (Seconds pause = kFirstPause;; pause = std::min(2.0 * pause, kLongestPause)) {
      lost_.reset();
      const Status status = TransactOnce(access, work);
      if (status || !lost_) return status;
      connection_.reset();
      if (Clock::now() - begin + pause > patience_) return GivenUp(status.error());
      if (pause == kFirstPause && on_note_) {
        on_note_(name_ + ": the connection was lost (" + *lost_ + "); for " +
                 ShortestText(patience_.count()) + " s another is tried");
      }
      std::this_thread::sleep_for(pause);
    }
  }

  Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(const PostgresAnswer answer, Answer(sql, values));
    return answer.changed;
  }

  Result<Table> Ask(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(PostgresAnswer answer, Answer(sql, values));
    return std::move(answer.table);
  }

  // As a cursor, which PostgreSQL makes only of what reads.
  Result<Table> AskAsGiven(const std::string& sql) override {
    Table table;
    const Status status = Transact(Access::kRead, [&]() -> Status {
      // Planned for all rows, not for the first.
      TRUETRIAD_RETURN_IF_ERROR(Ask("SELECT set_config('cursor_tuple_fraction', '1', true)", {}));
      TRUETRIAD_RETURN_IF_ERROR(
          Ask("DECLARE question NO SCROLL CURSOR FOR " + StorableText(sql), {}));
      TRUETRIAD_ASSIGN_OR_RETURN(table, Ask("FETCH ALL FROM question", {}));
      return {};
    });
    if (!status && IsOfTheQuestion(state_)) {
      return Error(
          ErrorCode::kInvalidArgument,
          "the question is not understood as one that reads (SELECT …): " + status.error().What());
    }
    TRUETRIAD_RETURN_IF_ERROR(status);
    return table;
  }

  // A read-only transaction keeps nobody from reading and writing the server's files, from its
  // settings, or from other sessions.
  Status AllowTypedText() override {
    bool may_do_more = true;
    TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kRead, [&]() -> Status {
      TRUETRIAD_ASSIGN_OR_RETURN(
          const Table roles,
          Ask("SELECT 1 FROM pg_roles AS mine CROSS JOIN pg_roles AS mighty WHERE mine.rolname IN "
              "(session_user, current_user) AND (mine.rolsuper OR (mighty.rolname IN "
              "('pg_read_server_files', 'pg_write_server_files', 'pg_execute_server_program') AND "
              "pg_has_role(mine.oid, mighty.oid, 'MEMBER'))) LIMIT 1",
              {}));
      may_do_more = !roles.rows.empty();
      return {};
    }));
    if (!may_do_more) return {};
    return Error(ErrorCode::kInvalidArgument,
                 name_ +
                     ": a superuser of PostgreSQL, or who may use the server's files or programs, "
                     "can do more by a question than read; ask as a role of its own: CREATE ROLE "
                     "reader LOGIN; GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader");
  }

  void TellNotes(std::function<void(const std::string&)> on_note) override {
    on_note_ = std::move(on_note);
  }

 private:
  /// Syntax and names, features, values, what a read-only transaction does not do.
  static bool IsOfTheQuestion(std::string_view state) {
    return state.starts_with("42") || state.starts_with("0A") || state.starts_with("22") ||
           state.starts_with("25");
  }

  Status TransactOnce(Access access, const std::function<Status()>& work) {
    state_.clear();
    if (!connection_) {
      PostgresFailure failure;
      connection_ = module_.connect(options_, &failure);
      if (!connection_) return Failed(failure);
    }
    if (const auto failure = connection_->Begin(access == Access::kRead)) return Failed(*failure);
    const Status status = work();
    // What reads has nothing to keep, whatever the functions that it calls do.
    if (!status || access == Access::kRead) {
      connection_->Abort();
      return status;
    }
    if (const auto failure = connection_->Commit()) return Failed(*failure);
    return {};
  }

  Error Failed(const PostgresFailure& failure) {
    state_ = failure.state;
    if (failure.is_lost) lost_ = failure.message;
    return Error(ErrorCode::kStoreFailure, {name_}, failure.message);
  }

  Error GivenUp(const Error& last) const {
    if (patience_ == Seconds(0.0)) return last;
    return Error(ErrorCode::kStoreFailure,
                 {name_},
                 "the connection was lost, and in " + ShortestText(patience_.count()) +
                     " s there was no other: " + last.What() +
                     "; what was added before is there, and --resume goes on");
  }

  Result<PostgresAnswer> Answer(std::string_view sql, std::span<const Value> values) {
    std::vector<std::optional<std::string>> texts;
    texts.reserve(values.size());
    std::vector<const char*> parameters;
    parameters.reserve(values.size());
    for (const Value& value : values) {
      const std::optional<std::string>& text = texts.emplace_back(ParameterText(value));
      parameters.push_back(text ? text->c_str() : nullptr);
    }
    PostgresAnswer answer;
    if (const auto failure = connection_->Run(std::string(sql), parameters, &answer)) {
      return Failed(*failure);
    }
    return answer;
  }

  Result<bool> HasTables() {
    // Not to_regclass, which may still say what was true before the lock of MakeTables was had.
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table fact,
        Ask("SELECT 1 FROM pg_class WHERE relname = 'fact' AND pg_table_is_visible(oid)", {}));
    if (fact.rows.empty()) return false;
    const Value name[] = {kStoreFact};
    TRUETRIAD_ASSIGN_OR_RETURN(const Table facts,
                               Ask("SELECT value FROM fact WHERE name = $1", name));
    if (!facts.rows.empty()) return true;
    return Error(ErrorCode::kStoreFailure,
                 {name_},
                 "has a table `fact`, but none that `fleet run` has made; name another database");
  }

  Status MakeTables() {
    const Value lock[] = {kTablesLock};
    TRUETRIAD_RETURN_IF_ERROR(Ask("SELECT pg_advisory_xact_lock($1)", lock));
    TRUETRIAD_ASSIGN_OR_RETURN(const bool has_tables, HasTables());
    if (has_tables) return {};
    const std::string tables =
        TablesSql({.text = "TEXT COLLATE \"C\"", .real = "DOUBLE PRECISION", .bytes = "BYTEA"});
    if (const auto failure = connection_->RunAll(tables)) {
      const Error error = Failed(*failure);
      constexpr std::string_view kDuplicateTable = "42P07";
      if (failure->state != kDuplicateTable) return error;
      return Error(ErrorCode::kStoreFailure,
                   {name_},
                   failure->message + ", but not from `fleet run`; name another database");
    }
    return {};
  }

  const PostgresModule& module_;
  std::string options_, name_;
  Seconds patience_{0.0};
  std::unique_ptr<PostgresConnection> connection_;
  std::function<void(const std::string&)> on_note_;
  std::string state_;                ///< SQLSTATE of the last failure of a transaction.
  std::optional<std::string> lost_;  ///< Why its connection was lost, if it was.
};

double StatedPatience() {
  constexpr double kPatienceS = 60.0;
  const char* const stated = std::getenv("TRUETRIAD_STORE_PATIENCE");
  if (stated == nullptr) return kPatienceS;
  char* end = nullptr;
  const double seconds = std::strtod(stated, &end);
  return end != stated && *end == '\0' && seconds >= 0.0 ? seconds : kPatienceS;
}

}  // namespace

Result<std::unique_ptr<Database>> OpenPostgres(const std::string& url, Access access) {
  TRUETRIAD_ASSIGN_OR_RETURN(const PostgresModule* const module, LoadedPostgresModule());
  return OpenPostgres(*module, url, access, StatedPatience());
}

Result<std::unique_ptr<Database>> OpenPostgres(const PostgresModule& module,
                                               const std::string& url,
                                               Access access,
                                               double patience_s) {
  auto database = std::make_unique<PostgresDatabase>(
      module, PostgresOptions(url).value_or(""), ShownPostgres(url));
  TRUETRIAD_RETURN_IF_ERROR(database->Open(access, Seconds(patience_s)));
  return std::unique_ptr<Database>(std::move(database));
}

Result<const PostgresModule*> LoadedPostgresModule() {
  const Result<void*> function = CompanionFunction(kPostgresModuleFile, kPostgresModuleFunction);
  if (!function) {
    return Error(
        ErrorCode::kMissingProgram,
        "a store on PostgreSQL needs a part that was not built: " + function.error().message +
            "; install libpqxx-dev and build truetriad again, or name a file");
  }
  return reinterpret_cast<const PostgresModule* (*)()>(*function)();
}

}  // namespace truetriad::fleet
