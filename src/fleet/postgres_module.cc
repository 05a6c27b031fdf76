// SPDX-License-Identifier: Apache-2.0
// The module truetriad_postgresql: PostgreSQL through libpqxx.
#include "fleet/postgres_module.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

#include <libpq-fe.h>
#include <pqxx/pqxx>

namespace truetriad::fleet {
namespace {

/// The types of values that are told from text, by number: those of PostgreSQL's own pg_type.
enum Type : pqxx::oid {
  kBool = 16,
  kBytes = 17,
  kInt8 = 20,
  kInt2 = 21,
  kInt4 = 23,
  kFloat4 = 700,
  kFloat8 = 701,
  kNumeric = 1700,
};

bool IsNumber(pqxx::oid type) {
  constexpr std::array kNumbers = {kBool, kInt8, kInt2, kInt4, kFloat4, kFloat8, kNumeric};
  return std::find(kNumbers.begin(), kNumbers.end(), type) != kNumbers.end();
}

/// As SQLite says it: 1 for true, bytes without \x.
std::string TextOf(const pqxx::field& field, pqxx::oid type) {
  if (type == kBool) return field.c_str()[0] == 't' ? "1" : "0";
  return type == kBytes ? field.c_str() + 2 : field.c_str();
}

Table TableOf(const pqxx::result& rows) {
  Table table;
  std::vector<pqxx::oid> types;
  for (pqxx::row::size_type i = 0; i < rows.columns(); ++i) {
    table.columns.emplace_back(rows.column_name(i));
    types.push_back(rows.column_type(i));
    table.are_numbers.push_back(IsNumber(types.back()));
    table.are_bytes.push_back(types.back() == kBytes);
  }
  table.rows.reserve(rows.size());
  for (const pqxx::row& row : rows) {
    std::vector<std::optional<std::string>>& cells = table.rows.emplace_back(row.size());
    for (pqxx::row::size_type i = 0; i < row.size(); ++i) {
      if (!row[i].is_null()) cells[i] = TextOf(row[i], types[i]);
    }
  }
  return table;
}

/// The first line of what libpq or the server says, without "ERROR:".
std::string FirstLine(std::string_view text) {
  text = text.substr(0, text.find('\n'));
  for (const std::string_view word : {"ERROR:  ", "FATAL:  ", "PANIC:  "}) {
    if (text.starts_with(word)) text.remove_prefix(word.size());
  }
  return std::string(text);
}

/// The server ends, has too many connections, or wants the transaction again (deadlock).
bool IsOfAMoment(std::string_view state) {
  constexpr std::array<std::string_view, 6> kClasses = {
      "08", "57P", "53300", "25P03", "40001", "40P01"};
  return std::any_of(kClasses.begin(), kClasses.end(), [&](std::string_view one) {
    return state.starts_with(one);
  });
}

class Connection : public PostgresConnection {
 public:
  explicit Connection(const std::string& options) : connection_(options), quiet_(connection_) {
    connection_.set_client_encoding("UTF8");
    // Of a server that is set up otherwise; what is stricter stays.
    pqxx::nontransaction(connection_)
        .exec(
            "SELECT set_config('synchronous_commit', 'on', false) WHERE "
            "current_setting('synchronous_commit') IN ('off', 'local')");
  }

  Outcome Begin(bool reads_only) override {
    return Tried([&] {
      if (reads_only) {
        using Reading = pqxx::transaction<pqxx::read_committed, pqxx::read_only>;
        transaction_ = std::make_unique<Reading>(connection_);
      } else {
        transaction_ = std::make_unique<pqxx::work>(connection_);
      }
    });
  }

  Outcome Commit() override {
    Outcome outcome = Tried([&] { transaction_->commit(); });
    transaction_.reset();
    return outcome;
  }

  void Abort() override { transaction_.reset(); }

  Outcome Run(const std::string& sql,
              const std::vector<const char*>& values,
              PostgresAnswer* answer) override {
    return Tried([&] {
      const pqxx::result rows =
          transaction_->exec_params(sql, pqxx::prepare::make_dynamic_params(values));
      answer->table = TableOf(rows);
      answer->changed = static_cast<std::int64_t>(rows.affected_rows());
    });
  }

  Outcome RunAll(const std::string& sql) override {
    return Tried([&] { transaction_->exec(sql); });
  }

 private:
  template <typename Action>
  Outcome Tried(const Action& action) {
    try {
      action();
      return std::nullopt;
    } catch (const pqxx::sql_error& failure) {
      return PostgresFailure{FirstLine(failure.what()),
                             failure.sqlstate(),
                             IsOfAMoment(failure.sqlstate()) || !connection_.is_open()};
    } catch (const std::exception& failure) {  // No connection, or a commit in doubt.
      return PostgresFailure{FirstLine(failure.what()), "", true};
    }
  }

  pqxx::connection connection_;
  pqxx::quiet_errorhandler quiet_;
  std::unique_ptr<pqxx::transaction_base> transaction_;
};

/// libpq's own `name='value'`.
std::string Option(std::string_view name, std::string_view value) {
  std::string option = std::string(name) + "='";
  for (const char c : value) {
    if (c == '\\' || c == '\'') option += '\\';
    option += c;
  }
  return option + "' ";
}

/// What `url` says, and what it leaves to this program: a server that does not answer is given up.
/// Unset: it says something that is not meant, such as half of a password as the host; what that is
/// stays unsaid.
std::optional<std::string> OptionsOf(const std::string& url) {
  const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> parsed(
      PQconninfoParse(url.c_str(), nullptr), PQconninfoFree);
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
      value = "10";  // s
    }
    if (value.empty() && name == "tcp_user_timeout") value = "30000";  // ms
    if (value.empty() && name == "fallback_application_name") value = "truetriad";
    if (!value.empty()) options += Option(name, value);
  }
  return options;
}

std::unique_ptr<PostgresConnection> Connect(const std::string& url, PostgresFailure* failure) {
  const std::optional<std::string> options = OptionsOf(url);
  if (!options) {
    *failure = {
        "is not understood as a connection to PostgreSQL; what is neither letter nor digit "
        "in a password is written %XX, or the password is left to ~/.pgpass",
        "",
        false};
    return nullptr;
  }
  try {
    return std::make_unique<Connection>(*options);
  } catch (const std::exception& error) {
    *failure = {FirstLine(error.what()), "", true};
    return nullptr;
  }
}

}  // namespace
}  // namespace truetriad::fleet

extern "C" const truetriad::fleet::PostgresModule* TruetriadPostgresModule() {
  static constexpr truetriad::fleet::PostgresModule kModule = {truetriad::fleet::Connect};
  return &kModule;
}
