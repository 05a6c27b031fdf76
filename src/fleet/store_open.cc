// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <regex>
#include <set>
#include <string_view>
#include <system_error>

#include "base/named_values.h"
#include "base/utf8.h"
#include "fleet/database.h"
#include "fleet/json_lines.h"
#include "fleet/log_files.h"
#include "fleet/store.h"
#include "io/input_guard.h"
#include "line/line_data.h"
#include "tree/json.h"

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
               "a decision must state " + what + " in one line of at most " +
                   std::to_string(longest) + " bytes of UTF-8");
}

constexpr std::string_view kSqlite = "sqlite:";

Result<std::unique_ptr<Store>> Open(const std::string& url, Access access) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(url));
  const std::optional<std::string> path = FileOfStore(url);
  if (path) TRUETRIAD_RETURN_IF_ERROR(CheckStoreFile(*path, access));
  if (path && JsonLinesPath(url)) {
    return access == Access::kRead ? NoQuestions(*path) : Store::OpenLines(*path);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<Database> database,
                             path ? OpenSqlite(*path, access) : OpenPostgres(url, access));
  return Store::Open(std::move(database));
}

}  // namespace

Status CheckStoreFile(const std::string& path, Access access) {
  namespace fs = std::filesystem;
  std::error_code failure;
  const fs::file_status status = fs::status(path, failure);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return Error(ErrorCode::kStoreFailure,
                 {path},
                 "is not a file (but a folder, pipe or device); name a file");
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
                 "a run with a wrong serial number did not measure this unit, so its only possible "
                 "verdict is `FAIL`");
  }
  for (const Verdict verdict : kVerdictsOfPeople) {
    if (verdict == disposition.verdict) return {};
    verdicts.append(verdicts.empty() ? "" : ", ").append(VerdictName(verdict));
  }
  return Error(ErrorCode::kInvalidArgument,
               "a person cannot decide `" + std::string(VerdictName(disposition.verdict)) +
                   "`; expected one of " + verdicts);
}

GoldenState GoldenStateOf(const StationCheck& last, double now_s, double due_s) {
  // Tolerated difference between the clocks of two machines, s.
  constexpr double kClocksDifferS = 60.0;
  if (!last.agrees) return GoldenState::kDisagrees;
  // With an unknown time the age is NaN, so the check is overdue.
  const double age_s = now_s - line::SecondsOf(last.recorded);
  if (age_s < -kClocksDifferS) return GoldenState::kToCome;
  return age_s <= due_s ? GoldenState::kGood : GoldenState::kOverdue;
}

std::string NameOfStore(const std::string& url) {
  const std::optional<std::string> file = FileOfStore(url);
  return file ? CanonicalPath(*file) : ShownStore(url);
}

std::string ShownStore(const std::string& url) {
  if (!CheckStoreUrl(url)) return "the stated store";
  return PostgresOptions(url) ? ShownPostgres(url) : url;
}

Result<std::unique_ptr<Store>> OpenStore(const std::string& url) {
  return Open(url, Access::kWrite);
}

Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(url));
  if (const std::optional<std::string> file = FileOfStore(url)) {
    // SQLite's other files belong to the store.
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
                 "--store: this name looks like a connection to a server; expected "
                 "postgresql://HOST/DATABASE, \"postgresql:host=HOST dbname=DATABASE\", or a file, "
                 "as in line.db or shard-2.jsonl");
  }
  if (!path.empty() && !path.starts_with(':') && !path.starts_with("file:")) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--store=" + url +
                   " names no file, so nothing would be kept; expected a file, as in line.db");
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
  // A quoted value may contain blanks, and a part of it could look like an option.
  if (values.find_first_of("'\\") != std::string::npos) return shown;
  for (std::sregex_iterator value(values.begin(), values.end(), kValue), end; value != end;
       ++value) {
    shown += (shown.ends_with(':') ? "" : " ") + value->str(1);
  }
  return shown;
}

namespace {

/// Whether `text` has a digit where `form` has 0, a hexadecimal digit where it has x, and equals it
/// elsewhere.
bool HasForm(std::string_view text, std::string_view form) {
  if (text.size() != form.size()) return false;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool is_digit = text[i] >= '0' && text[i] <= '9';
    const bool is_hex = is_digit || (text[i] >= 'a' && text[i] <= 'f');
    if (form[i] == '0' ? !is_digit : form[i] == 'x' ? !is_hex : text[i] != form[i]) return false;
  }
  return true;
}

Error Wrong(const std::string& what) { return Error(ErrorCode::kWrongFormat, what); }

/// A text with any contents, quoted and shortened, for messages.
std::string InWords(std::string_view text) {
  constexpr std::size_t kMost = 60;  // Chosen: fits on a line.
  return Json(std::string(text.substr(0, kMost)))
             .dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace) +
         (text.size() > kMost ? "…" : "");
}

Status CheckName(std::string_view name) {
  // A new name must be later than all others, and after a name of the year 9999 there is no later
  // one.
  constexpr std::string_view kTooLate = "2201";
  if (IsRunId(name) && name < kTooLate) return {};
  return Wrong("its name is " + InWords(name) +
               ", expected a time up to 2200 and 8 hexadecimal digits, as in "
               "20261124T235959.123456Z-4f2a9c01");
}

Status CheckTime(const std::string& time, const std::string& name = "created") {
  if (HasForm(time, "0000-00-00T00:00:00Z") && std::isfinite(line::SecondsOf(time))) return {};
  return Wrong(name + " is " + InWords(time) + ", expected a time as in 2026-11-24T23:59:59Z");
}

/// Error: the time of measurement or its source is invalid, or only one of the two is stated.
Status CheckRecorded(const UnitRun& run) {
  if (run.recorded.empty() && run.recorded_by.empty()) return {};
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(run.recorded, "recorded"));
  if (std::find(kRecordedBy.begin(), kRecordedBy.end(), run.recorded_by) != kRecordedBy.end()) {
    return {};
  }
  return Wrong("recorded_by is " + InWords(run.recorded_by) + ", expected list, recording or file");
}

/// Error: a number is not finite, or negative where it must not be.
Status CheckNumber(const std::string& name, double value, bool may_be_negative) {
  if (std::isfinite(value) && (may_be_negative || value >= 0.0)) return {};
  return Wrong(name + " is " + std::to_string(value) +
               (may_be_negative ? ", which is not finite" : ", expected 0 or more"));
}

Status CheckParameters(const UnitRun& run) {
  std::set<std::string_view> names;
  for (const Parameter& parameter : run.parameters) {
    if (parameter.name.empty() || !names.insert(parameter.name).second) {
      return Wrong("parameter " + InWords(parameter.name) + " occurs twice, or has no name");
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(parameter.name, parameter.value, true));
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("sigma of " + parameter.name, parameter.sigma, false));
  }
  const std::size_t size = run.parameters.size();
  if (!run.covariance.empty() && run.covariance.size() != size * (size + 1) / 2) {
    return Wrong("the covariance has " + std::to_string(run.covariance.size()) +
                 " numbers, but that of " + std::to_string(size) + " parameters has " +
                 std::to_string(size * (size + 1) / 2));
  }
  for (const double value : run.covariance) {
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("the covariance", value, true));
  }
  return {};
}

/// Error: the verdict contradicts the judgements.
Status CheckVerdict(const UnitRun& run) {
  const auto missed = std::find_if(run.judgements.begin(),
                                   run.judgements.end(),
                                   [](const LimitCheck& check) { return !check.pass; });
  const bool is_missed = missed != run.judgements.end();
  if (is_missed && !IsRed(run.verdict)) {
    return Wrong("its verdict is `" + std::string(VerdictName(run.verdict)) + "`, but its limit " +
                 InWords(missed->name) + " is missed");
  }
  if (is_missed || run.verdict != Verdict::kFail) return {};
  return Wrong("its verdict is `FAIL`, but it misses none of its limits");
}

}  // namespace

bool IsRunId(std::string_view name) {
  if (!HasForm(name, "00000000T000000.000000Z-xxxxxxxx")) return false;
  std::string moment(name.substr(0, 15));
  for (const std::size_t place : {4, 7}) moment.insert(place, "-");
  for (const std::size_t place : {13, 16}) moment.insert(place, ":");
  return std::isfinite(line::SecondsOf(moment));
}

Status CheckRun(const UnitRun& run) {
  constexpr std::size_t kLongestSerial = 1000;  // Bytes: 200 characters, or a file name.
  TRUETRIAD_RETURN_IF_ERROR(CheckName(run.id));
  if (run.serial.empty() || run.serial.size() > kLongestSerial ||
      run.serial.find('\0') != std::string::npos) {
    return Wrong("the serial number " + InWords(run.serial) + " has " +
                 std::to_string(run.serial.size()) + " bytes, expected 1 to " +
                 std::to_string(kLongestSerial) + " without NUL");
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(run.created));
  TRUETRIAD_RETURN_IF_ERROR(CheckRecorded(run));
  for (const std::string* const text : {&run.log, &run.folder}) {
    if (text->find('\0') != std::string::npos) return Wrong("a path has a NUL: " + InWords(*text));
  }
  for (const auto& [name, value] : {std::pair("wall_s", run.wall_s),
                                    {"cpu_s", run.cpu_s},
                                    {"effective_dof", run.effective_dof},
                                    {"log_bytes", static_cast<double>(run.log_bytes)}}) {
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(name, value, false));
  }
  for (const LimitCheck& check : run.judgements) {
    if (check.name.empty()) return Wrong("a judgement has no name");
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(check.name, check.worst, true));
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("sigma of " + check.name, check.sigma, false));
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckVerdict(run));
  return CheckParameters(run);
}

Status CheckStored(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckName(disposition.id));
  TRUETRIAD_RETURN_IF_ERROR(CheckName(disposition.run));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(disposition.created));
  const Status status = CheckDisposition(disposition);
  return status ? status : Status(Wrong(status.error().message));
}

Status CheckStored(const StationCheck& check) {
  TRUETRIAD_RETURN_IF_ERROR(CheckName(check.id));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(check.created));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(check.recorded, "recorded"));
  return check.station.empty() ? Status(Wrong("a check names no station")) : Status();
}

}  // namespace truetriad::fleet
