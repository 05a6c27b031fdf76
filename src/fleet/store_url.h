// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// What libpq takes of a store's URL: postgresql://…, postgres://…, or the name=value of
/// postgresql:name=value …. Unset: it is none of PostgreSQL.
std::optional<std::string> PostgresOptions(const std::string& url);

/// Error (usage): `url` names no file, what SQLite would take for something else than a file, or
/// looks like a connection to a server that was written otherwise; that is not shown, since it may
/// hold a password.
Status CheckStoreUrl(const std::string& url);

/// A URL of PostgreSQL for messages: server, port, database and user, and nothing else that it may
/// hold. Where it is not clear what is which, as in a password with a bare @ or ?, less of it.
std::string ShownPostgres(const std::string& url);

}  // namespace truetriad::fleet
