// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <sys/vfs.h>

#include "fleet/database.h"
#include "fleet/fleet_run.h"
#include "fleet/log_files.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// Whether the file system of a folder reports who writes to a file. Network file systems and those
/// of user programs (FUSE) do not.
bool SaysWhoWrites(const std::string& folder) {
  struct statfs about {};
  if (statfs(folder.c_str(), &about) != 0) return true;
  constexpr std::array<unsigned long, 3> kSilent = {
      0x65735546 /* FUSE */, 0x786F4256 /* VirtualBox */, 0x73757245 /* Coda */};
  const auto type = static_cast<unsigned long>(about.f_type) & 0xFFFFFFFFUL;
  return std::ranges::find(kSilent, type) == kSilent.end() &&
         NetworkFileSystemName(about.f_type).empty();
}

std::size_t FolderHash(const fs::path& file) { return fs::hash_value(file.parent_path()); }

/// Implements OpenLogWatch.
class LogWatch : public OrderSource {
 public:
  using Tell = std::function<void(const std::string&)>;

  LogWatch(WatchOptions options, DoneLogs done, Tell tell)
      : options_(std::move(options)),
        done_(std::move(done)),
        tell_(std::move(tell)),
        least_wait_(options_.look_s.value_or(SaysWhoWrites(options_.folder) ? 1.0 : 5.0)),
        wait_(least_wait_) {
    table_folders_.insert(fs::hash_value(fs::path(options_.folder)));
  }

  Status Look() override {
    if (Clock::now() < next_look_) return {};
    const Status status = LookAround();
    if (status.has_value() == is_failing_) {
      tell_(status ? options_.folder + " can be read again" : status.error().message);
      is_failing_ = !status;
    }
    if (IsIdle()) {
      // A file that is still missing is no longer waited for; the run will report it.
      std::erase_if(waiting_, [&](const auto& item) {
        const bool is_given = item.second.lacks_file && !item.second.is_written;
        if (is_given) Give(item.first);
        return is_given;
      });
    }
    return {};
  }

  /// Searches the folder and returns whether it could be read. Queues all logs that have no run and
  /// are unchanged since the last look; records the other logs that have no run.
  Status LookAround() {
    const Clock::time_point begin = Clock::now();
    std::map<std::string, State> found;
    folder_states_.clear();
    const auto enters = [this](const fs::path& folder) { return !IsLeftOut(folder); };
    const Status status = ForEachLog(options_.folder, enters, [&](const fs::path& path) {
      const std::string log = path.string();
      const std::optional<LogStamp> stamp = StampOf(log);
      if (!stamp || given_.contains(log)) return;
      const std::size_t hash = std::hash<std::string>()(log);
      if (IsDone(log, *stamp)) {
        if (!finished_.contains(hash)) skipped_.insert(hash);
        return;
      }
      skipped_.erase(hash);
      State state = StateOf(log, *stamp);
      const auto before = waiting_.find(log);
      const bool has_stayed = before != waiting_.end() && before->second.stamp == state.stamp;
      if (!has_stayed) last_change_ = Clock::now();
      if (has_stayed && !state.is_written && !state.lacks_file) {
        Give(log);
      } else {
        found[log] = std::move(state);
      }
    });
    waiting_ = std::move(found);
    constexpr double kMostOfTime = 1.0 / 20.0;  // Looks may take this share of the time.
    const Clock::time_point end = Clock::now();
    wait_ = std::max(least_wait_, Seconds(end - begin) / kMostOfTime);
    next_look_ = end + std::chrono::duration_cast<Clock::duration>(wait_);
    return status;
  }

  std::optional<Arrival> Next() override {
    while (!ready_.empty()) {
      const std::string log = std::move(ready_.front());
      ready_.pop_front();
      const std::optional<LogStamp> stamp = StampOf(log);
      Arrival arrival{.order = {.log = log}};
      const Status named = TakeSerial(options_.serial_pattern, &arrival.order);
      if (!stamp || done_.Has(arrival.order, *stamp)) {
        given_.erase(log);
        continue;
      }
      if (!named && named.error().code == ErrorCode::kInvalidValue) {
        tell_(named.error().message);  // No store accepts this name.
        done_.Add(log, *stamp, "", {});
        given_.erase(log);
        continue;
      }
      if (arrival.order.serial.empty()) {
        const std::hash<std::string> hash;
        const auto [first, is_new] = log_of_name_.try_emplace(hash(SerialOfName(log)), hash(log));
        arrival.order.shares_name = !is_new && first->second != hash(log);
      }
      if (!named) arrival.refusal = named.error();
      return arrival;
    }
    return std::nullopt;
  }

  bool HasEnded() const override {
    // A log to which no process writes will be queued at one of the next looks.
    return IsIdle() && std::all_of(waiting_.begin(), waiting_.end(), [](const auto& item) {
             return item.second.is_written;
           });
  }

  void Finish(const UnitRun& run) override {
    last_change_ = Clock::now();
    given_.erase(run.log);
    finished_.insert(std::hash<std::string>()(run.log));
    done_.Add(run.log, {run.log_bytes, run.log_modified_ns}, run.serial, run.tags);
  }

  void Again(const UnitRun& run) override { ready_.push_back(run.log); }

  std::size_t Given() const override { return given_.size(); }

  bool IsQuiet() const override {
    if (!options_.until_idle_s) return false;
    // A new log is queued at the second look after its arrival.
    constexpr double kLooks = 3.0;
    const Seconds idle = Clock::now() - last_change_;
    return idle.count() > std::max(*options_.until_idle_s, kLooks * wait_.count());
  }

  std::size_t Skipped() const override { return skipped_.size(); }
  bool HasSkipped(const std::string& log) const override {
    return skipped_.contains(std::hash<std::string>()(log));
  }

  std::vector<std::string> Left() const override {
    std::vector<std::string> notes;
    for (const auto& [log, state] : waiting_) {
      if (state.is_written) {
        notes.push_back(log + " is not calibrated: another program is still writing to it");
      } else if (state.lacks_file) {
        notes.push_back(log + " is not calibrated: it names files that do not exist");
      }
    }
    return notes;
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;

  /// The state of a log at a look.
  struct State {
    LogStamp stamp;           ///< The log is queued if this stays the same.
    bool is_written = false;  ///< A process writes to the log or a file that it names.
    bool lacks_file = false;  ///< A file that the log names is missing.
  };

  /// Whether the path is in the folder `without`.
  bool IsLeftOut(const fs::path& path) const {
    if (options_.without.empty()) return false;
    const std::string whole = CanonicalPath(path);
    return whole == options_.without || whole.starts_with(options_.without + "/");
  }

  bool IsDone(const std::string& log, const LogStamp& stamp) const {
    UnitOrder order{.log = log};
    // A name that does not match the pattern gives no serial number.
    (void)TakeSerial(options_.serial_pattern, &order).has_value();
    return done_.Has(order, stamp);
  }

  State StateOf(const std::string& log, const LogStamp& stamp) {
    const fs::path path = log;
    State state{.stamp = stamp, .is_written = IsBeingWritten(log)};
    if (path.filename() == kManifestName) {
      // If the manifest cannot be read, its run will report the error.
      for (const std::string& file : FilesOf(log).value_or(std::vector<std::string>())) {
        std::error_code failure;
        if (!fs::exists(file, failure)) state.lacks_file = true;
        if (IsBeingWritten(file)) state.is_written = true;
      }
      return state;
    }
    if (table_folders_.contains(FolderHash(path))) return state;
    // The recording.yaml of this table may not have arrived yet.
    const auto [folder, is_new] = folder_states_.try_emplace(path.parent_path());
    if (is_new) folder->second = StampOfFolder(path.parent_path());
    state.stamp = folder->second;
    return state;
  }

  bool IsIdle() const { return given_.empty() && IsQuiet(); }

  void Give(const std::string& log) {
    last_change_ = Clock::now();
    const fs::path path = log;
    if (path.filename() != kManifestName) table_folders_.insert(FolderHash(path));
    given_.insert(log);
    ready_.push_back(log);
  }

  WatchOptions options_;
  DoneLogs done_;
  Tell tell_;
  Seconds least_wait_, wait_;                   ///< Between two looks.
  std::map<std::string, State> waiting_;        ///< By log, as at the last look.
  std::map<fs::path, LogStamp> folder_states_;  ///< States of folders at this look.
  std::deque<std::string> ready_;
  std::set<std::string> given_;  ///< Logs queued and not finished.
  std::unordered_map<std::size_t, std::size_t>
      log_of_name_;                                ///< By hash of a name: hash of its first log.
  std::unordered_set<std::size_t> table_folders_;  ///< Hashes of folders whose tables were queued.
  /// Hashes of logs that were run in this watch, and of those that need no run.
  std::unordered_set<std::size_t> finished_, skipped_;
  bool is_failing_ = false;  ///< The folder cannot be read.
  Clock::time_point next_look_, last_change_ = Clock::now();
};

}  // namespace

Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSerialPattern(options.serial_pattern));
  fs::path normal = fs::path(options.folder).lexically_normal();
  if (!normal.has_filename()) normal = normal.parent_path();  // "line/" has an empty file name.
  options.folder = normal.string();
  if (!options.without.empty()) options.without = CanonicalPath(options.without);
  auto watch = std::make_unique<LogWatch>(std::move(options), std::move(done), std::move(tell));
  TRUETRIAD_RETURN_IF_ERROR(watch->LookAround());
  return std::unique_ptr<OrderSource>(std::move(watch));
}

}  // namespace truetriad::fleet
