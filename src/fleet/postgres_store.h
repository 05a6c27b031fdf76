// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "fleet/database.h"
#include "fleet/postgres_module.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A store on a PostgreSQL server, in the schema where its connection makes tables. A connection
/// that is lost later on is opened anew, and what it was about repeated, for as many seconds as the
/// environment variable TRUETRIAD_STORE_PATIENCE says, 60 if it does not. Errors as OpenStore.
Result<std::unique_ptr<Store>> OpenPostgres(const std::string& url, Access access);

/// The same, through `module`, which outlives the store.
Result<std::unique_ptr<Store>> OpenPostgres(const PostgresModule& module,
                                            const std::string& url,
                                            Access access,
                                            double patience_s);

/// Error (usage): this build cannot speak to PostgreSQL.
Result<const PostgresModule*> LoadedPostgresModule();

}  // namespace truetriad::fleet
