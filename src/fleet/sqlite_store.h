// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "fleet/database.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A store in one file, write-ahead log and `synchronous=FULL`. Errors as OpenStore.
Result<std::unique_ptr<Store>> OpenSqlite(const std::string& path, Access access);

/// "NFS" of statfs' `f_type`: a file system on which SQLite's locks do not hold. Else empty.
std::string_view NetworkFileSystemName(long magic);

}  // namespace truetriad::fleet
