// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <string_view>

#include "fleet/sqlite_store.h"

namespace truetriad::fleet {
namespace {

Result<std::unique_ptr<Store>> Open(const std::string& url, bool to_read) {
  constexpr std::string_view kSqlite = "sqlite:";
  if (url.starts_with(kSqlite)) return OpenSqlite(url.substr(kSqlite.size()), to_read);
  if (url.find("://") != std::string::npos) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store=" + url + ": expected a file, as in line.db or sqlite:line.db");
  }
  return OpenSqlite(url, to_read);
}

}  // namespace

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) { return Open(url, false); }

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) { return Open(url, true); }

}  // namespace truetriad::fleet
