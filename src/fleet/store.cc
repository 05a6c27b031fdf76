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
#include "fleet/shard.h"
#include "fleet/sqlite_store.h"
#include "fleet/store_url.h"
#include "io/input_guard.h"
#include "json/json.h"

namespace truetriad::fleet {
namespace {

constexpr NamedValues<RetestCounts, 3> kRetestCounts = {{
    {RetestCounts::kLast, "last"},
    {RetestCounts::kFirst, "first"},
    {RetestCounts::kBest, "best"},
}};

bool IsUtf8Text(const std::string& text) {
  try {
    return !Json(text).dump().empty();
  } catch (const Json::exception&) {
    return false;
  }
}

Status CheckLine(const std::string& what, const std::string& text, std::size_t longest) {
  const bool is_blank = text.find_first_not_of(" \t") == std::string::npos;
  const bool is_line = std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  if (!is_blank && is_line && IsUtf8Text(text) && text.size() <= longest) return {};
  return Error(ErrorCode::kInvalidArgument,
               "a disposition says " + what + " in one line of at most " + std::to_string(longest) +
                   " bytes of UTF-8");
}

/// The file of a store, where it is there, is one: a pipe would never end.
Status CheckFile(const std::string& path) {
  std::error_code failure;
  const std::filesystem::file_status status = std::filesystem::status(path, failure);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return {};
  return Error(ErrorCode::kStoreFailure, {path}, "is no file (a folder, pipe or device); name one");
}

constexpr std::string_view kSqlite = "sqlite:";

Result<std::unique_ptr<Store>> Open(const std::string& url, Access access) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(url));
  if (PostgresOptions(url)) return OpenPostgres(url, access);
  if (const std::optional<std::string> path = FileOfStore(url)) {
    TRUETRIAD_RETURN_IF_ERROR(CheckFile(*path));
  }
  if (const std::optional<std::string> path = JsonLinesPath(url)) {
    return OpenJsonLines(*path, access);
  }
  return OpenSqlite(FileOfStore(url).value_or(""), access);
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
  const std::string text = table.rows[0][0].value_or("");
  const std::optional<Shard> last = ShardFromText("0/" + text);
  if (last) return StatedShards{last->count, std::nullopt};
  return Error(ErrorCode::kStoreFailure,
               "its fact `shards` is `" + text +
                   "`, no number of shards; it has been changed by another program");
}

Status Store::ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take) {
  return ReadRuns(*this, which, take);
}

std::string_view RetestCountsName(RetestCounts counts) { return kRetestCounts.Name(counts); }

std::optional<RetestCounts> RetestCountsFromName(std::string_view name) {
  return kRetestCounts.Find(name);
}

std::string PolicyText(const RetestPolicy& policy) {
  return std::string(RetestCountsName(policy.counts)) +
         (policy.most ? ", " + std::to_string(*policy.most) + " more" : "");
}

std::string RecordingOf(const std::vector<InputFile>& inputs) {
  std::vector<std::string> hashes;
  for (const InputFile& input : inputs) {
    if (input.samples > 0) hashes.push_back(input.sha256);
  }
  std::sort(hashes.begin(), hashes.end());
  std::string recording;
  for (const std::string& hash : hashes) recording += (recording.empty() ? "" : " ") + hash;
  return recording;
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
  if (!CheckStoreUrl(url)) return "the store that is named";
  return PostgresOptions(url) ? ShownPostgres(url) : url;
}

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) {
  return Open(url, Access::kWrite);
}

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(url));
  if (const std::optional<std::string> file = FileOfStore(url)) {
    // SQLite's belong to it.
    for (const char* const ending : {"", "-wal", "-shm", "-journal"}) {
      InputGuard::Add(*file + ending);
    }
  }
  return Open(url, Access::kRead);
}

std::optional<std::string> FileOfStore(const std::string& url) {
  if (PostgresOptions(url)) return std::nullopt;
  if (const std::optional<std::string> path = JsonLinesPath(url)) return path;
  return url.starts_with(kSqlite) ? url.substr(kSqlite.size()) : url;
}

}  // namespace truetriad::fleet
