// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fleet/json_lines.h"
#include "fleet/rows.h"
#include "fleet/store.h"

namespace truetriad::fleet {
namespace {

/// A file that lines are appended to, by one process at a time.
class LineFile {
 public:
  explicit LineFile(std::string path) : path_(std::move(path)) {}
  ~LineFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  Status Open() {
    descriptor_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    struct stat about {};
    if (descriptor_ < 0 || fstat(descriptor_, &about) != 0) return Failure();
    if (!S_ISREG(about.st_mode)) {
      return Error(ErrorCode::kOutputInTheWay, {path_}, "is no file; name another");
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return {};
    if (errno == EWOULDBLOCK) {
      return Error(
          ErrorCode::kStoreFailure,
          {path_},
          "another run is writing to it; wait for its end, or give each a file of its own");
    }
    // A network folder that has no locks: nobody else is told to write to this file.
    const bool has_no_locks = errno == ENOLCK || errno == EOPNOTSUPP || errno == ENOSYS;
    return has_no_locks ? Status() : Failure();
  }

  /// Takes away what follows the last line end. The first line; empty: there is none.
  Result<std::string> Restore() {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t size, Size());
    TRUETRIAD_ASSIGN_OR_RETURN(end_, EndOfLines(size));
    std::string first;
    if (end_ == 0) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, Part(0, std::min(size, kPartBytes)));
      // A file of another kind is not touched.
      if (!IsCutHeader(text)) return ReadHeaderLine(path_, text).error();
    } else {
      TRUETRIAD_ASSIGN_OR_RETURN(first, Part(0, std::min(end_, kPartBytes)));
      first.resize(std::min(first.find('\n'), first.size()));
      TRUETRIAD_RETURN_IF_ERROR(ReadHeaderLine(path_, first));
    }
    if (end_ < size && ftruncate(descriptor_, end_) != 0) return Failure();
    return first;
  }

  /// On the disk when it returns; where that fails, nothing of it is there.
  Status Append(std::string_view text) {
    const std::size_t bytes = text.size();
    if (is_cut_ && ftruncate(descriptor_, end_) != 0) return Failure();
    while (!text.empty()) {
      const ssize_t written = write(descriptor_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return TakeBack();
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    if (fdatasync(descriptor_) != 0) return TakeBack();
    end_ += static_cast<std::int64_t>(bytes);
    return {};
  }

  /// The file's name is on the disk, too.
  Status FlushFolder() {
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    const int descriptor =
        open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    // A file system that cannot do it (EINVAL, ENOTSUP) has nothing to lose by it.
    const bool is_flushed =
        descriptor >= 0 && (fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP);
    const Status status = is_flushed ? Status() : Failure();
    if (descriptor >= 0) close(descriptor);
    return status;
  }

 private:
  static constexpr std::int64_t kPartBytes = 65536;

  Error Failure() const {
    return Error(ErrorCode::kStoreFailure,
                 {path_},
                 std::string("cannot be written: ") + std::strerror(errno));
  }
  Error TakeBack() {
    const Error error = Failure();
    is_cut_ = ftruncate(descriptor_, end_) != 0;
    return error;
  }

  Result<std::int64_t> Size() const {
    struct stat about {};
    if (fstat(descriptor_, &about) != 0) return Failure();
    return std::int64_t{about.st_size};
  }

  Result<std::string> Part(std::int64_t at, std::int64_t bytes) const {
    std::string part(static_cast<std::size_t>(bytes), '\0');
    const ssize_t count = pread(descriptor_, part.data(), part.size(), at);
    if (count != static_cast<ssize_t>(part.size())) return Failure();
    return part;
  }

  /// Behind the last line end of the first `size` bytes.
  Result<std::int64_t> EndOfLines(std::int64_t size) const {
    while (size > 0) {
      const std::int64_t begin = std::max<std::int64_t>(0, size - kPartBytes);
      TRUETRIAD_ASSIGN_OR_RETURN(const std::string part, Part(begin, size - begin));
      const std::size_t found = part.rfind('\n');
      if (found != std::string::npos) return begin + static_cast<std::int64_t>(found) + 1;
      size = begin;
    }
    return std::int64_t{0};
  }

  std::string path_;
  int descriptor_ = -1;
  std::int64_t end_ = 0;  ///< Bytes of whole lines.
  bool is_cut_ = false;   ///< More than those is there.
};

class JsonLinesStore : public Store {
 public:
  explicit JsonLinesStore(std::string path) : path_(std::move(path)), file_(path_) {}

  Status Open(Access access) {
    if (access == Access::kRead) {
      TRUETRIAD_ASSIGN_OR_RETURN(header_, ReadJsonLinesHeader(path_));
      return {};
    }
    TRUETRIAD_RETURN_IF_ERROR(file_.Open());
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string header, file_.Restore());
    if (header.empty()) return {};
    TRUETRIAD_ASSIGN_OR_RETURN(header_, ReadHeaderLine(path_, header));
    return {};
  }

  Status Add(const UnitRun& run) override {
    if (header_.shards.count == 0) {
      TRUETRIAD_RETURN_IF_ERROR(StateShard(ShardFromText(run.shard).value_or(Shard())));
    }
    TRUETRIAD_RETURN_IF_ERROR(file_.Append(LineOf(run)));
    if (latest_) NoteLatest(run);
    return {};
  }

  // The file is read for it once.
  Result<std::string> LatestRun(const UnitRun& run) override {
    TRUETRIAD_RETURN_IF_ERROR(NoteAll());
    std::string latest;
    for (const std::size_t key : KeysOf(run)) {
      const auto found = latest_->find(key);
      if (found != latest_->end()) latest = std::max(latest, found->second);
    }
    return latest;
  }

  Result<std::vector<RunName>> RunsOfSameReadings(const UnitRun& run) override {
    TRUETRIAD_RETURN_IF_ERROR(NoteAll());
    std::vector<RunName> runs;
    const auto [begin, end] = by_readings_.equal_range(RecordingOf(run.inputs));
    for (auto at = begin; at != end && !at->first.empty(); ++at) {
      const RunName& other = at->second;
      if (other.serial != run.serial && other.log != run.log) runs.push_back(other);
    }
    return runs;
  }

  Result<std::vector<KnownRun>> LastRuns() override {
    std::map<std::string, std::pair<std::string, KnownRun>> last;  // By log, with its run's name.
    TRUETRIAD_RETURN_IF_ERROR(ForEachLine(path_, [&](const UnitRun& run) -> Status {
      auto& [id, known] = last[run.log];
      if (run.id < id) return {};
      id = run.id;
      known = {run.log,
               run.log_bytes,
               run.log_modified_ns,
               run.config_sha256,
               run.software_version,
               run.verdict,
               run.serial,
               run.tags,
               run.code,
               run.recorded};
      return {};
    }));
    std::vector<KnownRun> runs;
    runs.reserve(last.size());
    for (auto& [log, run] : last) runs.push_back(std::move(run.second));
    return runs;
  }

  Status StateShard(const Shard& shard) override {
    const StatedShards& shards = header_.shards;
    if (shards.count == 0) {
      LinesHeader header = header_;  // With the policy, where one was stated.
      header.shards = {shard.count, shard.index};
      header.store = NewRunId();
      TRUETRIAD_RETURN_IF_ERROR(file_.Append(HeaderLine(header)));
      header_ = header;
      return file_.FlushFolder();
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckShards(path_, shards.count, shard.count));
    if (shards.only.value_or(shard.index) == shard.index) return {};
    return Error(ErrorCode::kConflictingArguments,
                 path_ + ": holds the runs of shard " + std::to_string(*shards.only) + " of " +
                     std::to_string(shards.count) + ", not of " + ShardText(shard) +
                     "; give each shard a file of its own");
  }

  Result<StatedShards> Shards() override { return header_.shards; }
  Result<std::string> Identity() override { return header_.store; }

  /// Kept in the first line: what was stated later than that cannot be.
  Status StateRetestPolicy(const RetestPolicy& policy) override {
    if (header_.shards.count == 0) header_.policy = policy;
    return CheckPolicy(path_, header_.policy.value_or(RetestPolicy()), policy);
  }
  Result<std::optional<RetestPolicy>> StatedRetestPolicy() override { return header_.policy; }

  Result<Disposition> Dispose(const Disposition&) override { return NoQuestions(); }
  Result<std::optional<StationCheck>> AddStationCheck(const StationCheck&) override {
    return NoQuestions();
  }
  Result<std::optional<StationCheck>> LastStationCheck(const std::string&) override {
    return NoQuestions();
  }
  Result<Decisions> ReadDecisions() override {
    TRUETRIAD_RETURN_IF_ERROR(ReadAll());
    return read_->decisions;
  }
  Status MarkEnd() override {
    if (header_.shards.count == 0) return {};
    read_.reset();
    TRUETRIAD_RETURN_IF_ERROR(ReadAll());
    if (read_->is_ended) return {};
    return file_.Append(EndLine(std::exchange(read_, std::nullopt)->counts));
  }
  Status CheckEnd() override {
    TRUETRIAD_RETURN_IF_ERROR(ReadAll());
    if (read_->is_ended) return {};
    return Error(ErrorCode::kDamagedFile,
                 {path_},
                 "has " + std::to_string(read_->counts.runs) +
                     " runs, and at its end no line that says these are all: `fleet run` is still "
                     "writing it, was ended before it was done or is of an older truetriad, or "
                     "lines have been cut off. Run the shard again with --resume, which does what "
                     "is missing, or collect what is there with --unfinished");
  }
  Status AddDecisions(const Decisions&) override { return NoQuestions(); }
  Result<Table> Query(const std::string&) override { return NoQuestions(); }

  Status ForEachRun(const RunSelection& which,
                    const std::function<Status(UnitRun)>& take) override {
    if (which.only_standing || which.with_standing || !which.where.empty()) return NoQuestions();
    LinesRead read;
    TRUETRIAD_RETURN_IF_ERROR(ForEachLine(path_, take, &read));
    read_ = std::move(read);
    return {};
  }

 private:
  Error NoQuestions() const {
    return Error(ErrorCode::kWrongFormat,
                 {path_},
                 "is a file of runs, which only keeps them; `truetriad fleet collect " + path_ +
                     " --store=fleet.db` makes a store of it");
  }

  Status ReadAll() {
    return read_ ? Status() : ForEachRun({}, [](const UnitRun&) { return Status(); });
  }

  Status NoteAll() {
    if (latest_) return {};
    latest_.emplace();
    by_readings_.clear();
    const Status status = ForEachLine(path_, [&](const UnitRun& one) -> Status {
      NoteLatest(one);
      return {};
    });
    if (!status) latest_.reset();
    return status;
  }

  /// By what a run's unit and its log are known.
  static std::array<std::size_t, 2> KeysOf(const UnitRun& run) {
    const std::hash<std::string> hash;
    return {hash("serial " + run.serial), hash("log " + run.log)};
  }
  void NoteLatest(const UnitRun& run) {
    for (const std::size_t key : KeysOf(run)) {
      std::string& latest = (*latest_)[key];
      latest = std::max(latest, run.id);
    }
    if (run.verdict == Verdict::kNoResult) return;
    by_readings_.emplace(RecordingOf(run.inputs), RunName{run.id, run.serial, run.log});
  }

  std::string path_;
  LineFile file_;
  LinesHeader header_;
  std::optional<std::unordered_map<std::size_t, std::string>> latest_;  ///< Runs, by KeysOf.
  std::unordered_multimap<std::string, RunName> by_readings_;  ///< Likewise, by RecordingOf.
  std::optional<LinesRead> read_;                              ///< Of the file, once it was.
};

}  // namespace

Result<std::unique_ptr<Store>> OpenJsonLines(const std::string& path, Access access) {
  namespace fs = std::filesystem;
  std::error_code failure;
  if (access == Access::kRead && !fs::exists(path, failure)) {
    return Error(ErrorCode::kUnreadableFile, {path}, "there is no such store");
  }
  const fs::path folder = fs::absolute(path, failure).parent_path();
  if (access == Access::kWrite) fs::create_directories(folder, failure);
  if (failure) {
    return Error(
        ErrorCode::kStoreFailure,
        {path},
        "cannot be written: there is no folder " + folder.string() + ": " + failure.message());
  }
  auto store = std::make_unique<JsonLinesStore>(path);
  TRUETRIAD_RETURN_IF_ERROR(store->Open(access));
  return std::unique_ptr<Store>(std::move(store));
}

std::optional<std::string> JsonLinesPath(const std::string& url) {
  constexpr std::string_view kScheme = "jsonl:";
  if (url.starts_with(kScheme)) return url.substr(kScheme.size());
  if (!url.starts_with("sqlite:") && url.ends_with(".jsonl")) return url;
  return std::nullopt;
}

}  // namespace truetriad::fleet
