// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fleet/store.h"

namespace truetriad::fleet {

// What speaks to a PostgreSQL server. libpqxx brings libpq, Kerberos, LDAP and more with it, which
// no other verb needs: it is a module that is loaded when such a store is asked for.

/// Why something was not done.
struct PostgresFailure {
  std::string message;  ///< Of the server or libpq, one line; without secrets.
  std::string state;    ///< SQLSTATE; empty: it is not the server's.
  /// There is no connection (any more), or the transaction has to be repeated. Whether it was done
  /// is not known.
  bool is_lost = false;
};

/// What a statement gave.
struct PostgresAnswer {
  Table table;
  std::int64_t changed = 0;  ///< Rows.
};

/// A connection, with one transaction at a time. All functions: unset where they have done it.
class PostgresConnection {
 public:
  using Outcome = std::optional<PostgresFailure>;

  virtual ~PostgresConnection() = default;
  virtual Outcome Begin(bool reads_only) = 0;
  virtual Outcome Commit() = 0;
  virtual void Abort() = 0;
  /// One statement, $1, $2, … being `values`, as text or NULL.
  virtual Outcome Run(const std::string& sql,
                      const std::vector<const char*>& values,
                      PostgresAnswer* answer) = 0;
  /// Several statements.
  virtual Outcome RunAll(const std::string& sql) = 0;
};

struct PostgresModule {
  /// `url`: as libpq takes it. Null, and why, where there is no connection.
  std::unique_ptr<PostgresConnection> (*connect)(const std::string& url, PostgresFailure* failure);
};

// The companion (base/companion.h) and its one function, `const PostgresModule* ()`.
inline constexpr char kPostgresModuleFile[] = "truetriad_postgresql.so";
inline constexpr char kPostgresModuleFunction[] = "TruetriadPostgresModule";

}  // namespace truetriad::fleet
