// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <string_view>

#include "fleet/json_lines_store.h"
#include "fleet/rows.h"
#include "fleet/run_reader.h"
#include "fleet/sqlite_store.h"
#include "io/input_guard.h"

namespace truetriad::fleet {
namespace {

constexpr std::string_view kSqlite = "sqlite:";

Result<std::unique_ptr<Store>> Open(const std::string& url, bool to_read) {
  if (const std::optional<std::string> path = JsonLinesPath(url)) {
    return OpenJsonLines(*path, to_read);
  }
  if (url.starts_with(kSqlite)) return OpenSqlite(url.substr(kSqlite.size()), to_read);
  if (url.find("://") != std::string::npos) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store=" + url + ": expected a file, as in line.db or shard-2.jsonl");
  }
  return OpenSqlite(url, to_read);
}

}  // namespace

Status Store::AddAll(std::span<const UnitRun> runs) {
  for (const UnitRun& run : runs) TRUETRIAD_RETURN_IF_ERROR(Add(run));
  return {};
}

Result<StatedShards> Store::Shards() {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, Query(std::string(kShards)));
  if (table.rows.empty()) return StatedShards();
  return StatedShards{std::stoi(table.rows[0][0].value_or("0")), std::nullopt};
}

Status Store::ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take) {
  return ReadRuns(*this, which, take);
}

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) { return Open(url, false); }

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) {
  if (const std::optional<std::string> file = FileOfStore(url)) {
    // SQLite's belong to it.
    for (const char* const ending : {"", "-wal", "-shm", "-journal"}) {
      InputGuard::Add(*file + ending);
    }
  }
  return Open(url, true);
}

std::optional<std::string> FileOfStore(const std::string& url) {
  if (const std::optional<std::string> path = JsonLinesPath(url)) return path;
  if (url.starts_with(kSqlite)) return url.substr(kSqlite.size());
  if (url.find("://") != std::string::npos) return std::nullopt;
  return url;
}

}  // namespace truetriad::fleet
