// SPDX-License-Identifier: Apache-2.0
#include "fleet/postgres.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <dlfcn.h>

#include "base/utf8.h"
#include "fleet/store.h"

namespace truetriad::fleet {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

/// Key of the lock for creating tables: eight bytes that no other program is likely to use.
constexpr std::int64_t kTablesLock = 0x7472'7566'7465'6574;

/// Text that PostgreSQL accepts: UTF-8 without NUL; other bytes become U+FFFD.
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
          return NumberText(stated);
        } else if constexpr (std::is_same_v<Stated, const std::vector<double>*>) {
          return "\\x" + HexOf({reinterpret_cast<const unsigned char*>(stated->data()),
                                stated->size() * sizeof(double)});
        } else {
          return StorableText(stated);
        }
      },
      value);
}

/// The types of values that are not text, by their numbers in PostgreSQL's pg_type.
enum Type : Oid {
  kBool = 16,
  kBytes = 17,
  kInt8 = 20,
  kInt2 = 21,
  kInt4 = 23,
  kFloat4 = 700,
  kFloat8 = 701,
  kNumeric = 1700,
};
constexpr std::array<Oid, 7> kNumbers = {kBool, kInt8, kInt2, kInt4, kFloat4, kFloat8, kNumeric};

/// The cell in the notation that SQLite uses: 1 for true, bytes without the prefix \x.
std::string CellText(const char* value, Oid type) {
  if (type == kBool) return value[0] == 't' ? "1" : "0";
  return type == kBytes ? value + 2 : value;
}

/// The first line of a message of libpq or the server, without "ERROR:".
std::string FirstLine(std::string_view text) {
  text = text.substr(0, text.find('\n'));
  for (const std::string_view word : {"ERROR:  ", "FATAL:  ", "PANIC:  "}) {
    if (text.starts_with(word)) text.remove_prefix(word.size());
  }
  return std::string(text);
}

/// Whether an SQLSTATE is temporary: a lost connection, a shutdown, too many clients, a deadlock.
bool IsOfAMoment(std::string_view state) {
  constexpr std::array<std::string_view, 6> kClasses = {
      "08", "57P", "53300", "25P03", "40001", "40P01"};
  return std::ranges::any_of(kClasses,
                             [&](std::string_view one) { return state.starts_with(one); });
}

/// An option in libpq's form `name='value'`.
std::string Option(std::string_view name, std::string_view value) {
  std::string option = std::string(name) + "='";
  for (const char c : value) {
    if (c == '\\' || c == '\'') option += '\\';
    option += c;
  }
  return option + "' ";
}

/// The options of `url` with this program's defaults, such as the timeouts for a silent server.
/// Unset: `url` is not valid, or a value is implausible, such as a host with part of a password.
std::optional<std::string> OptionsOf(const Libpq& libpq, const std::string& url) {
  const std::unique_ptr<PQconninfoOption, decltype(libpq.conninfoFree)> parsed(
      libpq.conninfoParse(url.c_str(), nullptr), libpq.conninfoFree);
  if (!parsed) return std::nullopt;
  std::string options;
  for (const PQconninfoOption* option = parsed.get(); option->keyword != nullptr; ++option) {
    const std::string_view name(option->keyword);
    std::string_view value(option->val == nullptr ? "" : option->val);
    if ((name == "host" || name == "dbname") && value.find('@') != std::string_view::npos) {
      return std::nullopt;
    }
    if (name == "port" && value.find_first_not_of("0123456789,") != std::string_view::npos) {
      return std::nullopt;
    }
    if (value.empty() && name == "connect_timeout" && std::getenv("PGCONNECT_TIMEOUT") == nullptr) {
      value = "10";  // In s: the longest wait for an answer.
    }
    if (value.empty() && name == "tcp_user_timeout") value = "30000";  // ms
    if (value.empty() && name == "fallback_application_name") value = "truetriad";
    if (name == "client_encoding") value = "UTF8";
    if (!value.empty()) options += Option(name, value);
  }
  return options;
}

class PostgresDatabase : public Database {
 public:
  PostgresDatabase(const Libpq& libpq, std::string options, std::string name)
      : libpq_(libpq), options_(std::move(options)), name_(std::move(name)) {}

  /// Connects and, if `access` is kWrite, creates missing tables. If the connection is lost after
  /// this call, it is reopened for up to `patience`.
  Status Open(Access access, Seconds patience) {
    bool has_tables = false;
    TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kRead, [&]() -> Status {
      TRUETRIAD_ASSIGN_OR_RETURN(has_tables, HasTables());
      return {};
    }));
    if (!has_tables && access == Access::kRead) {
      return Error(
          ErrorCode::kStoreFailure, {name_}, "has no tables of a store; `fleet run` adds them");
    }
    // The first process creates the tables; the others wait for it and then find them.
    if (!has_tables) {
      TRUETRIAD_RETURN_IF_ERROR(Transact(Access::kWrite, [&] { return MakeTables(); }));
    }
    patience_ = patience;
    return {};
  }

  const std::string& name() const override { return name_; }
  // Each statement is a round trip to the server; it takes at most 65535 values, and the widest
  // table has 21 columns (21 · 1000 values fit).
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
        on_note_(name_ + ": the connection was lost (" + *lost_ + "); reconnecting for up to " +
                 NumberText(patience_.count()) + " s");
      }
      std::this_thread::sleep_for(pause);
    }
  }

  Result<std::int64_t> Run(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(const Answer answer, Asked(sql, values));
    return std::strtoll(libpq_.cmdTuples(answer.get()), nullptr, 10);
  }

  Result<Table> Ask(std::string_view sql, std::span<const Value> values) override {
    TRUETRIAD_ASSIGN_OR_RETURN(const Answer answer, Asked(sql, values));
    Table table;
    const int columns = libpq_.nfields(answer.get());
    for (int column = 0; column < columns; ++column) {
      const Oid type = libpq_.ftype(answer.get(), column);
      table.columns.emplace_back(libpq_.fname(answer.get(), column));
      table.are_numbers.push_back(std::ranges::find(kNumbers, type) != kNumbers.end());
      table.are_bytes.push_back(type == kBytes);
    }
    table.rows.resize(static_cast<std::size_t>(libpq_.ntuples(answer.get())));
    for (int row = 0; row < std::ssize(table.rows); ++row) {
      std::vector<Cell>& cells = table.rows[static_cast<std::size_t>(row)];
      for (int column = 0; column < columns; ++column) {
        Cell& cell = cells.emplace_back();
        if (libpq_.getisnull(answer.get(), row, column) != 0) continue;
        cell = CellText(libpq_.getvalue(answer.get(), row, column),
                        libpq_.ftype(answer.get(), column));
      }
    }
    return table;
  }

  // Uses a cursor, which PostgreSQL creates only for reading statements.
  Result<Table> AskAsGiven(const std::string& sql) override {
    Table table;
    const Status status = Transact(Access::kRead, [&]() -> Status {
      // Plans the query for all rows instead of the first few.
      TRUETRIAD_RETURN_IF_ERROR(Ask("SELECT set_config('cursor_tuple_fraction', '1', true)", {}));
      TRUETRIAD_RETURN_IF_ERROR(
          Ask("DECLARE question NO SCROLL CURSOR FOR " + StorableText(sql), {}));
      TRUETRIAD_ASSIGN_OR_RETURN(table, Ask("FETCH ALL FROM question", {}));
      return {};
    });
    if (!status && IsOfTheQuestion(state_)) {
      return Error(ErrorCode::kInvalidArgument,
                   "the query is not valid, or does more than read: " + status.error().What());
    }
    TRUETRIAD_RETURN_IF_ERROR(status);
    return table;
  }

  // Even in a read-only transaction a query can use the server's files, its settings or other
  // sessions.
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
    return Error(
        ErrorCode::kInvalidArgument,
        name_ +
            ": the user is a superuser of PostgreSQL or may use the server's files or programs, so "
            "that a query could do more than read; connect as a role that may only read: CREATE "
            "ROLE reader LOGIN; GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader");
  }

  void TellNotes(std::function<void(const std::string&)> on_note) override {
    on_note_ = std::move(on_note);
  }

 private:
  /// Whether an SQLSTATE means that the query itself is wrong: its syntax, names, features or
  /// values, or that it writes.
  static bool IsOfTheQuestion(std::string_view state) {
    return state.starts_with("42") || state.starts_with("0A") || state.starts_with("22") ||
           state.starts_with("25");
  }

  using Connection = std::unique_ptr<PGconn, decltype(&PQfinish)>;
  using Answer = std::unique_ptr<PGresult, decltype(&PQclear)>;

  Status Connect() {
    connection_ = Connection(libpq_.connectdb(options_.c_str()), libpq_.finish);
    if (libpq_.status(connection_.get()) != CONNECTION_OK) return Failed("");
    // Commits wait for the disk, even if the server's default is not to wait. The server's notices
    // are not printed to stderr.
    return Done(
        "SET client_min_messages TO error; SELECT set_config('synchronous_commit', 'on', false) "
        "WHERE current_setting('synchronous_commit') IN ('off', 'local')");
  }

  Status TransactOnce(Access access, const std::function<Status()>& work) {
    state_.clear();
    if (!connection_) TRUETRIAD_RETURN_IF_ERROR(Connect());
    const bool to_read = access == Access::kRead;
    TRUETRIAD_RETURN_IF_ERROR(Done(to_read ? "BEGIN READ ONLY" : "BEGIN"));
    const Status status = work();
    if (status && !to_read) return Done("COMMIT");
    // A transaction that only reads is rolled back, so that functions that it calls change nothing.
    libpq_.clear(libpq_.exec(connection_.get(), "ROLLBACK"));
    return status;
  }

  /// Executes one or several statements without values.
  Status Done(const std::string& sql) {
    TRUETRIAD_RETURN_IF_ERROR(Checked(libpq_.exec(connection_.get(), sql.c_str())));
    return {};
  }

  /// The result of a statement, unless it failed.
  Result<Answer> Checked(PGresult* result) {
    Answer answer(result, libpq_.clear);
    const ExecStatusType status = libpq_.resultStatus(result);
    if (status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK) return answer;
    const char* const state = libpq_.resultErrorField(result, PG_DIAG_SQLSTATE);
    return Failed(state == nullptr ? "" : state);
  }

  /// Without a `state` (SQLSTATE) the connection counts as lost, too, since it is unknown whether
  /// the server has executed the statement.
  Error Failed(const std::string& state) {
    const std::string message = FirstLine(libpq_.errorMessage(connection_.get()));
    const bool is_open = libpq_.status(connection_.get()) == CONNECTION_OK;
    if (!is_open || state.empty() || IsOfAMoment(state)) lost_ = message;
    state_ = state;
    return Error(ErrorCode::kStoreFailure, {name_}, message);
  }

  Error GivenUp(const Error& last) const {
    if (patience_ == Seconds(0.0)) return last;
    return Error(ErrorCode::kStoreFailure,
                 {name_},
                 "the connection was lost, and not restored within " +
                     NumberText(patience_.count()) + " s: " + last.What() +
                     "; runs added before are kept, and --resume adds the rest");
  }

  /// Executes one statement with text or NULL for $1, $2, ….
  Result<Answer> Asked(std::string_view sql, std::span<const Value> values) {
    std::vector<std::optional<std::string>> texts;
    texts.reserve(values.size());
    std::vector<const char*> parameters;
    for (const Value& value : values) {
      const std::optional<std::string>& text = texts.emplace_back(ParameterText(value));
      parameters.push_back(text ? text->c_str() : nullptr);
    }
    return Checked(libpq_.execParams(connection_.get(),
                                     std::string(sql).c_str(),
                                     static_cast<int>(parameters.size()),
                                     nullptr,
                                     parameters.data(),
                                     nullptr,
                                     nullptr,
                                     /*resultFormat=*/0));
  }

  Result<bool> HasTables() {
    // to_regclass is not used: it may report the state before MakeTables obtained its lock.
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
                 "has a table `fact` that truetriad has not created; name another database");
  }

  Status MakeTables() {
    const Value lock[] = {kTablesLock};
    TRUETRIAD_RETURN_IF_ERROR(Ask("SELECT pg_advisory_xact_lock($1)", lock));
    TRUETRIAD_ASSIGN_OR_RETURN(const bool has_tables, HasTables());
    if (has_tables) return {};
    const std::string tables =
        TablesSql({.text = "TEXT COLLATE \"C\"", .real = "DOUBLE PRECISION", .bytes = "BYTEA"});
    const Status made = Done(tables);
    constexpr std::string_view kDuplicateTable = "42P07";
    if (made || state_ != kDuplicateTable) return made;
    return Error(ErrorCode::kStoreFailure,
                 {name_},
                 FirstLine(libpq_.errorMessage(connection_.get())) +
                     ", but was not created by truetriad; name another database");
  }

  const Libpq& libpq_;
  std::string options_, name_;
  Seconds patience_{0.0};
  Connection connection_{nullptr, libpq_.finish};
  std::function<void(const std::string&)> on_note_;
  std::string state_;                ///< SQLSTATE of the transaction's last failure.
  std::optional<std::string> lost_;  ///< Why the connection was lost; unset: it was not.
};

double StatedPatience() {
  constexpr double kPatienceS = 60.0;  // The documented default.
  const char* const stated = std::getenv("TRUETRIAD_STORE_PATIENCE");
  if (stated == nullptr) return kPatienceS;
  char* end = nullptr;
  const double seconds = std::strtod(stated, &end);
  return end != stated && *end == '\0' && seconds >= 0.0 ? seconds : kPatienceS;
}

}  // namespace

Result<std::unique_ptr<Database>> OpenPostgres(const std::string& url, Access access) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Libpq* const libpq, LoadedLibpq());
  return OpenPostgres(*libpq, url, access, StatedPatience());
}

Result<std::unique_ptr<Database>> OpenPostgres(const Libpq& libpq,
                                               const std::string& url,
                                               Access access,
                                               double patience_s) {
  const std::string name = ShownPostgres(url);
  std::optional<std::string> options = OptionsOf(libpq, PostgresOptions(url).value_or(""));
  if (!options) {
    return Error(ErrorCode::kStoreFailure,
                 {name},
                 "is not a valid connection to PostgreSQL; write characters of a password other "
                 "than letters and digits as %XX, or put the password into ~/.pgpass");
  }
  auto database = std::make_unique<PostgresDatabase>(libpq, *std::move(options), name);
  TRUETRIAD_RETURN_IF_ERROR(database->Open(access, Seconds(patience_s)));
  return std::unique_ptr<Database>(std::move(database));
}

namespace {

Result<Libpq> LoadLibpq() {
  Libpq libpq{};
  void* const library = dlopen("libpq.so.5", RTLD_NOW | RTLD_LOCAL);
  bool is_whole = library != nullptr;
  const auto find = [&]<typename Function>(const char* name, Function* function) {
    if (is_whole) *function = reinterpret_cast<Function>(dlsym(library, name));
    is_whole = is_whole && *function != nullptr;
  };
  find("PQclear", &libpq.clear);
  find("PQcmdTuples", &libpq.cmdTuples);
  find("PQconnectdb", &libpq.connectdb);
  find("PQconninfoFree", &libpq.conninfoFree);
  find("PQconninfoParse", &libpq.conninfoParse);
  find("PQerrorMessage", &libpq.errorMessage);
  find("PQexec", &libpq.exec);
  find("PQexecParams", &libpq.execParams);
  find("PQfinish", &libpq.finish);
  find("PQfname", &libpq.fname);
  find("PQftype", &libpq.ftype);
  find("PQgetisnull", &libpq.getisnull);
  find("PQgetvalue", &libpq.getvalue);
  find("PQnfields", &libpq.nfields);
  find("PQntuples", &libpq.ntuples);
  find("PQresultErrorField", &libpq.resultErrorField);
  find("PQresultStatus", &libpq.resultStatus);
  find("PQstatus", &libpq.status);
  if (is_whole) return libpq;
  return Error(ErrorCode::kMissingProgram,
               "a store on PostgreSQL needs its client library, which cannot be loaded: " +
                   std::string(dlerror()) + "; install libpq5, or name a file");
}

}  // namespace

Result<const Libpq*> LoadedLibpq() {
  static const auto& loaded = *new Result<Libpq>(LoadLibpq());
  if (!loaded) return loaded.error();
  return &*loaded;
}

}  // namespace truetriad::fleet
