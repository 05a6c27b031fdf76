// SPDX-License-Identifier: Apache-2.0
#include "fleet/log_files.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fleet/fields.h"
#include "io/csv_reader.h"
#include "io/recording_layout.h"
#include "io/text_file.h"
#include "io/whole_file.h"
#include "line/line_data.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNsPerSecond = 1'000'000'000;  // 1 s.

bool IsHiddenOrHalf(const std::string& name) {
  return name.starts_with('.') || IsTemporaryName(name);
}

std::optional<LogStamp> StampOfFile(const fs::path& file) {
  struct stat about {};
  if (stat(file.c_str(), &about) != 0) return std::nullopt;
  return LogStamp{about.st_size,
                  std::int64_t{about.st_mtim.tv_sec} * kNsPerSecond + about.st_mtim.tv_nsec};
}

/// The state of several files. Any change of a file changes this state, even if the file becomes
/// older.
LogStamp StampOfAll(const std::vector<std::string>& files) {
  LogStamp all;
  std::string states;
  for (const std::string& file : files) {
    const std::optional<LogStamp> own = StampOfFile(file);
    states += own ? std::to_string(own->bytes) + "," + std::to_string(own->modified_ns) : "none";
    states += ';';
    if (!own) continue;
    all.bytes += own->bytes;
    all.modified_ns = std::max(all.modified_ns, own->modified_ns);
  }
  const std::uint64_t digest = std::stoull(Sha256Hex(states).substr(0, 15), nullptr, 16);
  all.modified_ns +=
      static_cast<std::int64_t>(digest % kNsPerSecond) - all.modified_ns % kNsPerSecond;
  return all;
}

}  // namespace

bool EndsIn(const std::string& name, std::string_view ending) {
  return LowerCase(name).ends_with(ending);
}

std::string WholePath(const fs::path& path) {
  return fs::absolute(path).lexically_normal().string();
}

std::string CanonicalPath(const fs::path& path) {
  std::error_code failure;
  // The path is made absolute first, since weakly_canonical keeps a missing path relative.
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path), failure);
  return failure ? WholePath(path) : canonical.lexically_normal().string();
}

std::optional<std::vector<std::string>> FilesOf(const std::string& manifest) {
  struct Known {
    LogStamp stamp;
    std::vector<std::string> files;
  };
  // A watch looks up each manifest at every look. 100,000 entries take about 50 MB.
  constexpr std::size_t kMostKnown = 100'000;
  static thread_local std::unordered_map<std::string, Known> known;
  const std::optional<LogStamp> stamp = StampOfFile(manifest);
  if (!stamp) return std::nullopt;
  if (const auto found = known.find(manifest);
      found != known.end() && found->second.stamp == *stamp) {
    return found->second.files;
  }
  Result<std::vector<std::string>> files = FilesOfManifest(manifest);
  if (!files) return std::nullopt;
  if (known.size() >= kMostKnown) known.clear();
  known[manifest] = {*stamp, *files};
  return *std::move(files);
}

namespace {

/// Whether the path is *.csv or *.csv.gz, in upper or lower case, and neither hidden nor temporary.
bool IsTable(const fs::path& path) {
  const std::string name = path.filename().string();
  return (EndsIn(name, ".csv") || EndsIn(name, ".csv.gz")) && !IsHiddenOrHalf(name);
}

/// Whether a folder is searched: hidden folders, temporary ones and results (*.truetriad) are not.
bool IsEntered(const fs::path& folder) {
  return folder.extension() != ".truetriad" && !IsHiddenOrHalf(folder.filename().string());
}

/// Whether a table has a column named like a reading. True if the table cannot be read: its run
/// will report the error.
bool HasReadings(const std::string& table) {
  const Result<std::unique_ptr<CsvReader>> csv = CsvReader::OpenHead(table);
  if (!csv) return true;
  const std::vector<std::string>& header = (*csv)->header();
  return std::any_of(header.begin(), header.end(), [](const std::string& column) {
    const std::string called = SeeminglyCalled(ParseHeaderColumn(column).name);
    return !called.empty() && called != "time" && called != "temperature";
  });
}

/// Whether a table beside a recording.yaml belongs to it: it is named there, or has no sensor
/// readings (attitudes, rates). If the recording.yaml cannot be read, all tables beside it belong
/// to it: its run will report the error.
bool BelongsToManifest(const fs::path& table) {
  const std::string manifest = (table.parent_path() / kManifestName).string();
  const std::optional<std::vector<std::string>> named = FilesOf(manifest);
  if (!named) return true;
  const std::string whole = WholePath(table);
  return std::any_of(named->begin(),
                     named->end(),
                     [&](const std::string& file) { return WholePath(file) == whole; }) ||
         !HasReadings(table.string());
}

/// Walks through a folder and its subfolders, and enters each of them only once.
class Walk {
 public:
  Walk(const std::function<bool(const fs::path&)>& enters,
       const std::function<void(const fs::path&)>& on_log)
      : enters_(enters), on_log_(on_log) {}

  Status Through(const fs::path& folder) {
    Visit(folder, /*is_first=*/true);
    for (std::size_t i = 0; i < links_.size(); ++i) Visit(fs::path(links_[i]), /*is_first=*/false);
    for (const fs::path& log : logs_) {
      if (elsewhere_.empty() || !elsewhere_.contains(WholePath(log))) on_log_(log);
    }
    return status_;
  }

 private:
  void Visit(const fs::path& folder, bool is_first) {
    struct stat about {};
    if (stat(folder.c_str(), &about) == 0 && !seen_.emplace(about.st_dev, about.st_ino).second) {
      return;
    }
    if (!enters_(folder)) return;
    std::error_code failure, vanished;
    const bool has_manifest = fs::exists(folder / kManifestName, vanished);
    if (has_manifest) TakeManifest(folder);
    for (fs::directory_iterator at(folder, failure), end; !failure && at != end;
         at.increment(failure)) {
      if (!at->is_directory(vanished)) {
        if (IsTable(at->path()) && !(has_manifest && BelongsToManifest(at->path()))) {
          logs_.push_back(at->path());
        }
      } else if (!IsEntered(at->path())) {
        continue;
      } else if (at->is_symlink(vanished)) {
        links_.push_back(at->path());
      } else {
        Visit(at->path(), /*is_first=*/false);
      }
    }
    const bool is_gone = failure == std::errc::no_such_file_or_directory;
    if (!failure || (is_gone && !is_first) || !status_) return;
    status_ = Error(
        ErrorCode::kUnreadableFile, {folder.string()}, "cannot be read: " + failure.message());
  }

  void TakeManifest(const fs::path& folder) {
    logs_.push_back(folder / kManifestName);
    const std::string here = WholePath(folder);
    for (const std::string& file : FilesOf(logs_.back()).value_or(std::vector<std::string>())) {
      std::string whole = WholePath(file);
      if (fs::path(whole).parent_path() != here) elsewhere_.insert(std::move(whole));
    }
  }

  const std::function<bool(const fs::path&)>& enters_;
  const std::function<void(const fs::path&)>& on_log_;
  std::vector<fs::path> logs_;
  std::set<std::string> elsewhere_;  ///< Tables that another folder's recording.yaml names.
  std::set<std::pair<dev_t, ino_t>> seen_;
  std::vector<fs::path> links_;  ///< Links to folders.
  Status status_;
};

}  // namespace

Status ForEachLog(const fs::path& folder,
                  const std::function<bool(const fs::path&)>& enters,
                  const std::function<void(const fs::path&)>& on_log) {
  return Walk(enters, on_log).Through(folder);
}

LogStamp StampOfFolder(const fs::path& folder) {
  std::vector<std::string> files;
  std::error_code failure;
  for (fs::directory_iterator at(folder, failure), end; !failure && at != end;
       at.increment(failure)) {
    if (IsTable(at->path()) || at->path().filename() == kManifestName) {
      files.push_back(at->path().string());
    }
  }
  return StampOfAll(files);
}

std::optional<LogStamp> StampOf(const std::string& log) {
  const std::optional<LogStamp> own = StampOfFile(log);
  if (!own || !IsManifest(log)) return own;
  std::vector<std::string> files = FilesOf(log).value_or(std::vector<std::string>());
  files.push_back(log);
  return StampOfAll(files);
}

namespace {

Recorded RecordedIn(std::int64_t time_ns, std::string_view by) {
  return {line::MomentOf(std::min<std::int64_t>(time_ns / kNsPerSecond, std::time(nullptr))), by};
}

}  // namespace

Recorded RecordedOf(const LogStamp& stamp) { return RecordedIn(stamp.modified_ns, kByFile); }

std::optional<Recorded> RecordedOf(const PoseSet& poses) {
  // 9 September 2001. A clock that counts from power-up reaches this value only after 31.7 years.
  constexpr std::int64_t kLeastNs = 1'000'000'000 * kNsPerSecond;
  if (!poses.has_time || poses.start_ns < kLeastNs) return std::nullopt;
  return RecordedIn(poses.start_ns, kByRecording);
}

bool IsBeingWritten(const std::string& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  // A read lease is refused while a process has the file open for writing. A process that opens the
  // file during the lease waits for the end of the lease. The signal that would report this process
  // is ignored.
  fcntl(descriptor, F_SETSIG, SIGURG);
  const bool is_refused = fcntl(descriptor, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  fcntl(descriptor, F_SETLEASE, F_UNLCK);
  close(descriptor);
  return is_refused;
}

namespace {

/// Hashes of a log's state and of its stated serial number, tags and time of measurement.
std::vector<std::size_t> HashesOf(const LogStamp& stamp,
                                  const std::string& serial,
                                  const Tags& tags,
                                  const std::string& recorded) {
  std::vector<std::size_t> hashes;
  const auto add = [&hashes](std::string_view name, const std::string& value) {
    if (!value.empty()) {
      hashes.push_back(std::hash<std::string>()(std::string(name) + "=" + value));
    }
  };
  add("stamp", std::to_string(stamp.bytes) + "," + std::to_string(stamp.modified_ns));
  add("serial", serial);
  add("recorded", recorded);
  TagFields(add, tags);
  return hashes;
}

}  // namespace

Result<DoneLogs> DoneLogs::In(Store& store, const std::string& config_sha256) {
  DoneLogs done;
  const auto take = [&](const UnitRun& run) {
    if (run.config_sha256 != config_sha256 || run.software_version != Version()) return;
    // The log of a refused copy is calibrated again: the user may have removed the other unit's
    // log, as advised.
    if (run.code == InfoOf(ErrorCode::kOtherDevice).name) return;
    // Only a time that a list stated is part of the state: the log itself states all others.
    const bool is_stated = run.recorded_by == kByList;
    done.Add(run.log,
             {run.log_bytes, run.log_modified_ns},
             run.serial,
             run.tags,
             is_stated ? run.recorded : "");
  };
  TRUETRIAD_RETURN_IF_ERROR(store.ForEachLastRun(take));
  return done;
}

void DoneLogs::Add(const std::string& log,
                   const LogStamp& stamp,
                   const std::string& serial,
                   const Tags& tags,
                   const std::string& recorded) {
  logs_[std::hash<std::string>()(log)] = HashesOf(stamp, serial, tags, recorded);
}

bool DoneLogs::Has(const UnitOrder& order, const LogStamp& stamp) const {
  const auto found = logs_.find(std::hash<std::string>()(order.log));
  return found != logs_.end() &&
         std::ranges::all_of(
             HashesOf(stamp, order.serial, order.tags, order.recorded), [&](std::size_t wanted) {
               return std::ranges::find(found->second, wanted) != found->second.end();
             });
}

bool DoneLogs::Has(const UnitOrder& order) const {
  const std::optional<LogStamp> stamp = StampOf(order.log);
  return stamp && Has(order, *stamp);
}

}  // namespace truetriad::fleet
