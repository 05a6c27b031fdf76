// SPDX-License-Identifier: Apache-2.0
#include "fleet/store.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "base/named_values.h"
#include "fleet/database.h"
#include "fleet/json_lines_store.h"
#include "fleet/postgres_store.h"
#include "fleet/run_reader.h"
#include "fleet/sqlite_store.h"
#include "fleet/store_url.h"
#include "io/input_guard.h"

namespace truetriad::fleet {
namespace {

constexpr NamedValues<RetestCounts, 3> kRetestCounts = {{
    {RetestCounts::kLast, "last"},
    {RetestCounts::kFirst, "first"},
    {RetestCounts::kBest, "best"},
}};

Status CheckLine(const std::string& what, const std::string& text, std::size_t longest) {
  const bool is_blank = text.find_first_not_of(" \t") == std::string::npos;
  const bool is_line = std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  if (!is_blank && is_line && text.size() <= longest) return {};
  return Error(ErrorCode::kInvalidArgument,
               "a disposition says " + what + " in one line of at most " + std::to_string(longest) +
                   " bytes");
}

constexpr std::string_view kSqlite = "sqlite:";

Result<std::unique_ptr<Store>> Open(const std::string& url, Access access) {
  if (PostgresOptions(url)) return OpenPostgres(url, access);
  if (const std::optional<std::string> path = JsonLinesPath(url)) {
    return OpenJsonLines(*path, access);
  }
  if (url.starts_with(kSqlite)) return OpenSqlite(url.substr(kSqlite.size()), access);
  if (const std::size_t scheme = url.find("://"); scheme != std::string::npos) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store=" + url.substr(0, scheme) +
                     "://…: expected a file, as in line.db or shard-2.jsonl, or "
                     "postgresql://HOST/DATABASE");
  }
  return OpenSqlite(url, access);
}

}  // namespace

Status Store::AddAll(std::span<const UnitRun> runs) {
  for (const UnitRun& run : runs) TRUETRIAD_RETURN_IF_ERROR(Add(run));
  return {};
}

Result<bool> Store::Has(const std::string& run) {
  bool has = false;
  TRUETRIAD_RETURN_IF_ERROR(ForEachRun({}, [&](const UnitRun& one) -> Status {
    has = has || one.id == run;
    return {};
  }));
  return has;
}

Result<StatedShards> Store::Shards() {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                             Query("SELECT value FROM fact WHERE name = 'shards'"));
  if (table.rows.empty()) return StatedShards();
  return StatedShards{std::stoi(table.rows[0][0].value_or("0")), std::nullopt};
}

Status Store::ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take) {
  return ReadRuns(*this, which, take);
}

std::string_view RetestCountsName(RetestCounts counts) { return kRetestCounts.Name(counts); }

std::optional<RetestCounts> RetestCountsFromName(std::string_view name) {
  return kRetestCounts.Find(name);
}

Status CheckDisposition(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("who decided it", disposition.who, 200));
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("why", disposition.why, 2000));
  std::string verdicts;
  for (const Verdict verdict : kVerdictsOfPeople) {
    if (verdict == disposition.verdict) return {};
    verdicts.append(verdicts.empty() ? "" : ", ").append(VerdictName(verdict));
  }
  return Error(ErrorCode::kInvalidArgument,
               "people do not decide `" + std::string(VerdictName(disposition.verdict)) +
                   "`; expected one of " + verdicts);
}

std::string NameOfStore(const std::string& url) {
  const std::optional<std::string> file = FileOfStore(url);
  if (!file) return ShownStore(url);
  std::error_code failure;
  // Absolute first: what is not there yet stays relative.
  const std::filesystem::path path =
      std::filesystem::weakly_canonical(std::filesystem::absolute(*file), failure);
  return failure ? *file : path.string();
}

std::string ShownStore(const std::string& url) {
  return PostgresOptions(url) ? ShownPostgres(url) : url;
}

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) {
  return Open(url, Access::kWrite);
}

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) {
  if (const std::optional<std::string> file = FileOfStore(url)) {
    // SQLite's belong to it.
    for (const char* const ending : {"", "-wal", "-shm", "-journal"}) {
      InputGuard::Add(*file + ending);
    }
  }
  return Open(url, Access::kRead);
}

std::optional<std::string> FileOfStore(const std::string& url) {
  if (PostgresOptions(url) || url.find("://") != std::string::npos) return std::nullopt;
  if (const std::optional<std::string> path = JsonLinesPath(url)) return path;
  return url.starts_with(kSqlite) ? url.substr(kSqlite.size()) : url;
}

}  // namespace truetriad::fleet
