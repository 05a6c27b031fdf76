// SPDX-License-Identifier: Apache-2.0
#include "fleet/json_lines.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <unordered_set>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "fleet/fields.h"
#include "fleet/store.h"
#include "io/whole_file.h"
#include "tree/json.h"

namespace truetriad::fleet {

void Fields(auto&& visit, Like<LineCounts> auto& counts) {
  visit("runs", counts.runs);
  visit("dispositions", counts.dispositions);
  visit("station_checks", counts.station_checks);
}

namespace {

constexpr std::string_view kFormat = "truetriad/runs";
constexpr std::size_t kLongestHeader = 4096;  // Bytes; today's header has under 300.

Error NoHeader(const std::string& path) {
  return Error(
      ErrorCode::kWrongFormat,
      {path, 1},
      "is not a file of runs: expected the header that `fleet run --store=NAME.jsonl` writes, "
      "{\"format\":\"" +
          std::string(kFormat) + "\",…}");
}

Error Unreadable(const std::string& path) {
  return Error(
      ErrorCode::kStoreFailure, {path}, std::string("cannot be read: ") + std::strerror(errno));
}

Result<std::ifstream> Opened(const std::string& path) {
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreFile(path, Access::kRead));
  std::ifstream file(path, std::ios::binary);
  if (!file) return Unreadable(path);
  return file;
}

/// Error (bad input): the line is not a header of a file of runs, or states another version.
Result<StoreHeader> ReadHeaderLine(const std::string& path, std::string_view line) {
  const Json header = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!header.is_object() || header.value("format", Json()) != kFormat) return NoHeader(path);
  TRUETRIAD_RETURN_IF_ERROR(CheckSchemaVersion(
      path, header.contains(kSchemaVersionName) ? header[kSchemaVersionName].dump() : ""));
  try {
    StoreHeader stated;
    stated.shards.count = header.at("shards");
    if (header.contains("shard")) stated.shards.only = header["shard"].get<int>();
    stated.store = header.value("store", "");
    if (header.contains("retest_counts")) {
      const std::string counts = header["retest_counts"];
      stated.policy = {RetestCountsFromName(counts).value(), std::nullopt};
      if (header.contains("retest_most")) stated.policy->most = header["retest_most"];
    }
    const int only = stated.shards.only.value_or(0);
    const bool is_policy = !stated.policy || stated.policy->most.value_or(0) >= 0;
    if (only >= 0 && only < stated.shards.count && stated.shards.count <= kMostShards &&
        is_policy) {
      return stated;
    }
  } catch (const std::exception&) {  // A field has another type or is missing.
  }
  return NoHeader(path);
}

/// The first line with its end; empty: there is none, or a killed writer left it incomplete.
Result<std::string> FirstLine(std::ifstream* file, const std::string& path) {
  std::string text(kLongestHeader, '\0');
  file->read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file->gcount()));
  file->clear();
  const std::size_t size = text.find('\n') + 1;
  if (size > 0) {
    file->seekg(static_cast<std::streamoff>(size));
    return text.substr(0, size);
  }
  const std::string start = "{\"format\":\"" + std::string(kFormat) + '"';
  if (text.starts_with(start) || start.starts_with(text)) return std::string();
  return NoHeader(path);
}

Status CheckShardOf(const UnitRun& run, const StatedShards& shards) {
  const std::optional<Shard> shard = ShardFromText(run.shard);
  if (shard && shard->count == shards.count && shard->index == shards.only.value_or(shard->index)) {
    return {};
  }
  return Error(
      ErrorCode::kDoesNotMatch,
      "is a run of shard `" + run.shard + "`, but the first line of the file states " +
          (shards.only ? "shard " + std::to_string(*shards.only) + " of " : "the shard count ") +
          std::to_string(shards.count));
}

std::string TextOf(const LineCounts& counts) {
  return std::to_string(counts.runs) + " runs, " + std::to_string(counts.dispositions) +
         " decisions and " + std::to_string(counts.station_checks) + " checks of stations";
}

/// Reads the lines after the header.
class LinesReader {
 public:
  /// Returns the run of a line; unset: the line has other contents.
  Result<std::optional<UnitRun>> Take(const std::string& line) {
    read_.is_ended = false;
    UnitRun run;
    try {
      const Json json = Json::parse(line);
      if (json.contains("end")) return Kept(End(ThingFrom<LineCounts>(json["end"])));
      if (json.contains("disposition")) {
        Disposition disposition = ThingFrom<Disposition>(json["disposition"]);
        disposition.serial = json["disposition"].at("serial");
        return Kept(Keep(std::move(disposition)));
      }
      if (json.contains("station_check")) {
        return Kept(Keep(ThingFrom<StationCheck>(json["station_check"])));
      }
      run = UnitRunFrom(json);
    } catch (const std::exception& failure) {  // From the JSON reader or UnitRunFrom.
      return Error(ErrorCode::kWrongFormat,
                   std::string("is not a valid record of a fleet run: ") + failure.what());
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckRun(run));
    TRUETRIAD_RETURN_IF_ERROR(CheckShardOf(run, read_.header.shards));
    runs_.insert(std::hash<std::string>()(run.id));
    ++read_.counts.runs;
    return std::optional(std::move(run));
  }
  LinesRead& read() { return read_; }

 private:
  static Result<std::optional<UnitRun>> Kept(const Status& status) {
    TRUETRIAD_RETURN_IF_ERROR(status);
    return std::optional<UnitRun>();
  }
  Status End(const LineCounts& stated) {
    read_.is_ended = true;
    if (stated == read_.counts) return {};
    return Error(ErrorCode::kDamagedFile,
                 "states that " + TextOf(stated) + " are on the lines above, but there are " +
                     TextOf(read_.counts) + "; restore the file as it was written");
  }
  Status Keep(Disposition disposition) {
    TRUETRIAD_RETURN_IF_ERROR(CheckStored(disposition));
    if (!runs_.contains(std::hash<std::string>()(disposition.run))) {
      return Error(
          ErrorCode::kDoesNotMatch,
          "is a decision about run " + disposition.run + ", but no line above has that run");
    }
    ++read_.counts.dispositions;
    read_.decisions.dispositions.push_back(std::move(disposition));
    return {};
  }
  Status Keep(StationCheck check) {
    TRUETRIAD_RETURN_IF_ERROR(CheckStored(check));
    ++read_.counts.station_checks;
    read_.decisions.checks.push_back(std::move(check));
    return {};
  }

  LinesRead read_;
  std::unordered_set<std::size_t> runs_;  ///< Hashes of the names of runs.
};

}  // namespace

std::string HeaderLine(const StoreHeader& header) {
  Json json = {
      {"format", kFormat}, {kSchemaVersionName, kSchemaVersion}, {"shards", header.shards.count}};
  if (header.shards.only) json["shard"] = *header.shards.only;
  if (!header.store.empty()) json["store"] = header.store;
  if (header.policy) json["retest_counts"] = RetestCountsName(header.policy->counts);
  if (header.policy && header.policy->most) json["retest_most"] = *header.policy->most;
  return LineOfJson(json);
}

std::string LineOf(const Disposition& disposition) {
  Json json = TreeOf(disposition);
  json["serial"] = disposition.serial;
  return LineOfJson({{"disposition", json}});
}

std::string LineOf(const StationCheck& check) {
  return LineOfJson({{"station_check", TreeOf(check)}});
}

std::string EndLine(const LineCounts& above) { return LineOfJson({{"end", TreeOf(above)}}); }

std::optional<StoreHeader> HeaderOf(const std::string& path) {
  Result<std::ifstream> file = Opened(path);
  if (!file) return std::nullopt;
  const Result<std::string> first = FirstLine(&*file, path);
  if (!first) return std::nullopt;
  const Result<StoreHeader> header = ReadHeaderLine(path, *first);
  return header ? std::optional(*header) : std::nullopt;
}

Result<LinesRead> ForEachLine(const std::string& path, const std::function<Status(UnitRun)>& take) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::ifstream file, Opened(path));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string first, FirstLine(&file, path));
  if (first.empty()) return LinesRead();
  LinesReader reader;
  LinesRead& read = reader.read();
  TRUETRIAD_ASSIGN_OR_RETURN(read.header, ReadHeaderLine(path, first));
  read.bytes = std::ssize(first);
  std::string line;
  // The loop ends before a last line without a newline, which is incomplete.
  for (std::int64_t number = 2; std::getline(file, line) && !file.eof(); ++number) {
    Result<std::optional<UnitRun>> run = reader.Take(line);
    if (!run) return Error(run.error().code, {path, number}, run.error().message);
    read.bytes += std::ssize(line) + 1;
    if (*run) TRUETRIAD_RETURN_IF_ERROR(take(**std::move(run)));
  }
  // If `line` is not empty, a killed writer left it incomplete.
  if (!line.empty()) read.is_ended = false;
  if (file.bad()) return Unreadable(path);
  return std::move(read);
}

RunLines::~RunLines() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<std::unique_ptr<RunLines>> RunLines::Open(const std::string& path,
                                                 const std::function<Status(UnitRun)>& take) {
  std::unique_ptr<RunLines> lines(new RunLines(path));
  TRUETRIAD_RETURN_IF_ERROR(lines->Lock());
  TRUETRIAD_ASSIGN_OR_RETURN(lines->read_, ForEachLine(path, take));
  if (ftruncate(lines->descriptor_, lines->read_.bytes) != 0) return lines->Failure();
  return lines;
}

Status RunLines::Lock() {
  descriptor_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) return Failure();
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return {};
  if (errno == EWOULDBLOCK) {
    return Error(
        ErrorCode::kStoreFailure,
        {path_},
        "another process is writing to this file; wait for its end, or give each fleet run "
        "its own file");
  }
  // A network folder may have no locks. Then writers are not protected from each other.
  const bool has_no_locks = errno == ENOLCK || errno == EOPNOTSUPP || errno == ENOSYS;
  return has_no_locks ? Status() : Failure();
}

Status RunLines::Begin(const StoreHeader& header) {
  TRUETRIAD_RETURN_IF_ERROR(Append(HeaderLine(header)));
  read_.header = header;
  return IsFolderOnDisk(path_) ? Status() : Status(Failure());
}

Status RunLines::Add(const UnitRun& run) {
  TRUETRIAD_RETURN_IF_ERROR(Append(LineOf(run)));
  ++read_.counts.runs;
  read_.is_ended = false;
  return {};
}

Status RunLines::End() {
  if (!HasBegun() || read_.is_ended) return {};
  TRUETRIAD_RETURN_IF_ERROR(Append(EndLine(read_.counts)));
  read_.is_ended = true;
  return {};
}

Status RunLines::Append(std::string_view text) {
  const auto bytes = std::ssize(text);
  const auto take_back = [this] {
    const Error error = Failure();
    is_cut_ = ftruncate(descriptor_, read_.bytes) != 0;
    return error;
  };
  if (is_cut_ && ftruncate(descriptor_, read_.bytes) != 0) return Failure();
  while (!text.empty()) {
    const ssize_t written = write(descriptor_, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return take_back();
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (fdatasync(descriptor_) != 0) return take_back();
  read_.bytes += bytes;
  return {};
}

Error RunLines::Failure() const {
  return Error(
      ErrorCode::kStoreFailure, {path_}, std::string("cannot be written: ") + std::strerror(errno));
}

Error NoQuestions(const std::string& path) {
  return Error(ErrorCode::kWrongFormat,
               {path},
               "is a file of runs, which cannot be queried; `truetriad fleet collect " + path +
                   " --store=fleet.db` makes a database of it");
}

std::optional<std::string> JsonLinesPath(const std::string& url) {
  constexpr std::string_view kScheme = "jsonl:";
  if (url.starts_with(kScheme)) return url.substr(kScheme.size());
  if (!url.starts_with("sqlite:") && url.ends_with(".jsonl")) return url;
  return std::nullopt;
}

}  // namespace truetriad::fleet
