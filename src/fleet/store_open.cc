// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <regex>
#include <string_view>
#include <system_error>

#include "base/named_values.h"
#include "base/utf8.h"
#include "fleet/database.h"
#include "fleet/json_lines.h"
#include "fleet/store.h"
#include "io/input_guard.h"
#include "line/line_data.h"

namespace truetriad::fleet {
namespace {

std::optional<int> WholeNumber(std::string_view text) {
  int number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

std::optional<Shard> ShardFromText(std::string_view text) {
  if (text.empty()) return Shard();
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const std::optional<int> index = WholeNumber(text.substr(0, slash));
  const std::optional<int> count = WholeNumber(text.substr(slash + 1));
  if (!index || !count || *index < 0 || *index >= *count || *count > kMostShards) {
    return std::nullopt;
  }
  return Shard{*index, *count};
}

std::string ShardText(const Shard& shard) {
  return shard.count == 1 ? "" : std::to_string(shard.index) + "/" + std::to_string(shard.count);
}

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
  if (!is_blank && is_line && IsUtf8(text) && text.size() <= longest) return {};
  return Error(ErrorCode::kInvalidArgument,
               "a disposition says " + what + " in one line of at most " + std::to_string(longest) +
                   " bytes of UTF-8");
}

/// The file of a store, where it is there, is one: a pipe would never end. To read it is there, and
/// to write its folder.
Status CheckFile(const std::string& path, Access access) {
  namespace fs = std::filesystem;
  std::error_code failure;
  const fs::file_status status = fs::status(path, failure);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return Error(
        ErrorCode::kStoreFailure, {path}, "is no file (a folder, pipe or device); name one");
  }
  if (access == Access::kRead) {
    if (fs::exists(status)) return {};
    return Error(ErrorCode::kUnreadableFile, {path}, "there is no such store");
  }
  const fs::path folder = fs::absolute(path, failure).parent_path();
  fs::create_directories(folder, failure);
  if (!failure) return {};
  return Error(
      ErrorCode::kStoreFailure,
      {path},
      "cannot be written: there is no folder " + folder.string() + ": " + failure.message());
}

constexpr std::string_view kSqlite = "sqlite:";

Result<std::unique_ptr<Store>> Open(const std::string& url, Access access) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(url));
  const std::optional<std::string> path = FileOfStore(url);
  if (path) TRUETRIAD_RETURN_IF_ERROR(CheckFile(*path, access));
  if (path && JsonLinesPath(url)) {
    return access == Access::kRead ? NoQuestions(*path) : Store::OpenLines(*path);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Database> database,
                             path ? OpenSqlite(*path, access) : OpenPostgres(url, access));
  return Store::Open(std::move(database));
}

}  // namespace

std::string_view RetestCountsName(RetestCounts counts) { return kRetestCounts.Name(counts); }

std::optional<RetestCounts> RetestCountsFromName(std::string_view name) {
  return kRetestCounts.Find(name);
}

std::string PolicyText(const RetestPolicy& policy) {
  return std::string(RetestCountsName(policy.counts)) +
         (policy.most ? ", " + std::to_string(*policy.most) + " more" : "");
}

std::string RecordingOf(const std::vector<SensorReadings>& readings) {
  std::vector<std::string> digests;
  for (const SensorReadings& one : readings) digests.push_back(one.digest);
  std::sort(digests.begin(), digests.end());
  std::string recording;
  for (const std::string& digest : digests) recording += (recording.empty() ? "" : " ") + digest;
  return recording;
}

Status CheckDisposition(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("who decided it", disposition.who, 200));
  TRUETRIAD_RETURN_IF_ERROR(CheckLine("why", disposition.why, 2000));
  std::string verdicts;
  if (disposition.GivesUp() && disposition.verdict != Verdict::kFail) {
    return Error(ErrorCode::kConflictingArguments,
                 "a unit whose serial number was wrong was not measured, so is `FAIL`");
  }
  for (const Verdict verdict : kVerdictsOfPeople) {
    if (verdict == disposition.verdict) return {};
    verdicts.append(verdicts.empty() ? "" : ", ").append(VerdictName(verdict));
  }
  return Error(ErrorCode::kInvalidArgument,
               "people do not decide `" + std::string(VerdictName(disposition.verdict)) +
                   "`; expected one of " + verdicts);
}

GoldenState GoldenStateOf(const StationCheck& last, double now_s, double due_s) {
  // The clocks of two machines may differ by this much.
  constexpr double kClocksDifferS = 60.0;
  if (!last.agrees) return GoldenState::kDisagrees;
  // NaN: what cannot be dated is no check of today.
  const double age_s = now_s - line::SecondsOf(last.recorded);
  if (age_s < -kClocksDifferS) return GoldenState::kToCome;
  return age_s <= due_s ? GoldenState::kGood : GoldenState::kOverdue;
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

namespace {

constexpr std::string_view kScheme = "postgresql:";

}  // namespace

std::optional<std::string> PostgresOptions(const std::string& url) {
  if (url.starts_with("postgresql://") || url.starts_with("postgres://")) return url;
  if (url.starts_with(kScheme)) return url.substr(kScheme.size());
  return std::nullopt;
}

Status CheckStoreUrl(const std::string& url) {
  if (PostgresOptions(url)) return {};
  std::string_view path(url);
  for (const std::string_view scheme : {"sqlite:", "jsonl:"}) {
    if (!path.starts_with(scheme)) continue;
    path.remove_prefix(scheme.size());
    break;
  }
  constexpr std::array<std::string_view, 5> kOfServers = {
      "://", "password=", "host=", "dbname=", "service="};
  if (std::any_of(kOfServers.begin(), kOfServers.end(), [&](std::string_view part) {
        return path.find(part) != std::string_view::npos;
      })) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store: what is named looks like a connection to a server; expected "
                 "postgresql://HOST/DATABASE, \"postgresql:host=HOST dbname=DATABASE\", or a file, "
                 "as in line.db or shard-2.jsonl");
  }
  if (!path.empty() && !path.starts_with(':') && !path.starts_with("file:")) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--store=" + url +
                   " names no file, so that nothing would be kept; expected one, as in line.db");
}

std::string ShownPostgres(const std::string& url) {
  // User, password, and server with port and database; then parameters.
  static const std::regex kUri(
      R"(postgres(?:ql)?://(?:([^:@/?]*)(?::[^@/?]*)?@)?)"
      R"(((?:\[[0-9A-Fa-f:]*\]|[^:@/?]*)(?::[0-9]*)?(?:/[^?@]*)?)(?:\?[^@]*)?)");
  static const std::regex kValue(R"((?:^|\s)((?:host|hostaddr|port|dbname|user)=\S+))");
  if (!url.starts_with(kScheme) || url.starts_with("postgresql://")) {
    std::smatch parts;
    if (!std::regex_match(url, parts, kUri)) return "postgresql://";
    return "postgresql://" + (parts[1].matched ? parts.str(1) + "@" : "") + parts.str(2);
  }
  std::string shown(kScheme);
  const std::string values = url.substr(kScheme.size());
  // A value may have blanks in it, which look like the next one.
  if (values.find_first_of("'\\") != std::string::npos) return shown;
  for (std::sregex_iterator value(values.begin(), values.end(), kValue), end; value != end;
       ++value) {
    shown += (shown.ends_with(':') ? "" : " ") + value->str(1);
  }
  return shown;
}

}  // namespace truetriad::fleet
