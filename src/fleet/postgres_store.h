// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "fleet/database.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A store on a PostgreSQL server, in the schema where its connection makes tables. A connection
/// that is lost later on is opened anew for as many seconds as the environment variable
/// TRUETRIAD_STORE_PATIENCE says, 60 if it does not. Errors as OpenStore; (usage): this build
/// cannot speak to PostgreSQL.
Result<std::unique_ptr<Store>> OpenPostgres(const std::string& url, Access access);

}  // namespace truetriad::fleet
