// SPDX-License-Identifier: Apache-2.0
#include "fleet/log_watch.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "fleet/database.h"
#include "fleet/log_files.h"
#include "fleet/unit_list.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWatched = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE |
                                   IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR | IN_EXCL_UNLINK;

/// Another name of a file that was there: it is not made by writing, so nobody closes it.
bool IsLink(const fs::path& path) {
  struct stat about {};
  return lstat(path.c_str(), &about) == 0 && (S_ISLNK(about.st_mode) || about.st_nlink > 1);
}

/// What happens in folders, as Linux tells it (inotify). About 200 bytes a folder.
class FolderEvents {
 public:
  enum class Kind {
    kWhole,      ///< A file was closed after writing, or got this name.
    kAppeared,   ///< A link to a file was made: nobody will close it.
    kNewFolder,  ///< A folder was made, or got this name.
    kGone,       ///< A folder that is watched was removed or renamed.
    kLost,       ///< More has happened than could be kept; no path.
  };
  struct Event {
    Kind kind = Kind::kLost;
    fs::path path = {};
  };

  /// Error (bad input): the system has no more of them.
  static Result<std::unique_ptr<FolderEvents>> Open() {
    const int stream = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    if (stream < 0) {
      return Error(ErrorCode::kSystemFailure,
                   std::string("folders cannot be watched: ") + std::strerror(errno));
    }
    return std::unique_ptr<FolderEvents>(new FolderEvents(stream));
  }

  ~FolderEvents() { close(stream_); }

  FolderEvents(const FolderEvents&) = delete;
  FolderEvents& operator=(const FolderEvents&) = delete;

  /// Tells of `folder` from now on, not of those below it. Error (bad input): it cannot be watched,
  /// or the system watches as many as it is set to.
  Status Watch(const fs::path& folder) {
    const int watch = inotify_add_watch(stream_, folder.c_str(), kWatched);
    if (watch >= 0) {
      folders_[watch] = folder;
      return {};
    }
    if (errno == ENOSPC) {
      return Error(ErrorCode::kSystemFailure,
                   {folder.string()},
                   "is one folder more than this system watches (" +
                       std::to_string(folders_.size()) +
                       " are); raise fs.inotify.max_user_watches");
    }
    return Error(ErrorCode::kUnreadableFile,
                 {folder.string()},
                 std::string("cannot be watched: ") + std::strerror(errno));
  }

  /// What has happened since.
  std::vector<Event> Take() {
    std::vector<Event> events;
    alignas(inotify_event) std::array<char, 65536> buffer;
    for (;;) {
      const ssize_t size = read(stream_, buffer.data(), buffer.size());
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0) return events;
      for (ssize_t at = 0; at < size;) {
        const auto* const event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
        if ((event->mask & IN_Q_OVERFLOW) != 0) {
          events.push_back({.kind = Kind::kLost});
          continue;
        }
        const auto folder = folders_.find(event->wd);
        if (folder == folders_.end()) continue;
        if ((event->mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_UNMOUNT | IN_IGNORED)) != 0) {
          const fs::path path = folder->second;
          events.push_back({Kind::kGone, path});
          Forget(path);
          continue;
        }
        const fs::path path = folder->second / event->name;
        if ((event->mask & IN_ISDIR) != 0) {
          if ((event->mask & (IN_CREATE | IN_MOVED_TO)) != 0) {
            events.push_back({Kind::kNewFolder, path});
          } else if ((event->mask & IN_MOVED_FROM) != 0) {
            Forget(path);
          }
        } else if ((event->mask & (IN_CLOSE_WRITE | IN_MOVED_TO)) != 0) {
          events.push_back({Kind::kWhole, path});
        } else if ((event->mask & IN_CREATE) != 0 && IsLink(path)) {
          events.push_back({Kind::kAppeared, path});
        }
      }
    }
  }

 private:
  explicit FolderEvents(int stream) : stream_(stream) {}
  /// Forgets a folder that has another name now, and those below it.
  void Forget(const fs::path& folder) {
    const std::string below = folder.string() + "/";
    std::erase_if(folders_, [&](const auto& item) {
      const bool is_within = item.second == folder || item.second.string().starts_with(below);
      if (is_within) inotify_rm_watch(stream_, item.first);
      return is_within;
    });
  }

  int stream_;
  std::unordered_map<int, fs::path> folders_;  ///< By watch.
};

/// "NFS", "FUSE", …: a file system that says nothing of what other machines, or programs behind it,
/// write to `folder`. Else empty.
std::string_view FileSystemWithoutEvents(const std::string& folder) {
  struct statfs about {};
  if (statfs(folder.c_str(), &about) != 0) return "";
  constexpr std::array<std::pair<unsigned long, std::string_view>, 3> kSilent = {
      {{0x65735546, "FUSE"}, {0x786F4256, "VirtualBox"}, {0x73757245, "Coda"}}};
  for (const auto& [known, name] : kSilent) {
    if ((static_cast<unsigned long>(about.f_type) & 0xFFFFFFFFUL) == known) return name;
  }
  return NetworkFileSystemName(about.f_type);
}

constexpr double kPollS = 5.0;  ///< Where none do, unless said otherwise.

std::string StampText(const LogStamp& stamp) {
  return std::to_string(stamp.bytes) + "," + std::to_string(stamp.modified_ns) + ";";
}

/// By which a folder is known, whatever links lead to it.
std::string CanonicalPath(const fs::path& path) {
  std::error_code failure;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path), failure);
  return failure ? WholePath(path) : canonical.string();
}

std::size_t FolderHash(const fs::path& file) { return fs::hash_value(file.parent_path()); }

/// OpenLogWatch.
class LogWatch : public OrderSource {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// Error (bad input): the folder or one below cannot be read. Error (usage): the serial pattern.
  static Result<std::unique_ptr<OrderSource>> Open(WatchOptions options, DoneLogs done, Tell tell) {
    TRUETRIAD_RETURN_IF_ERROR(CheckSerialPattern(options.serial_pattern));
    fs::path normal = fs::path(options.folder).lexically_normal();
    if (!normal.has_filename()) normal = normal.parent_path();  // "line/".
    options.folder = normal.string();
    if (!options.without.empty()) options.without = CanonicalPath(options.without);
    std::unique_ptr<LogWatch> watch(
        new LogWatch(std::move(options), std::move(done), std::move(tell)));
    const std::string& folder = watch->options_.folder;
    if (!watch->options_.poll_s) {
      const std::string_view blind = FileSystemWithoutEvents(folder);
      Result<std::unique_ptr<FolderEvents>> events = FolderEvents::Open();
      if (blind.empty() && events) {
        watch->events_ = std::move(*events);
      } else {
        watch->TurnToPolling(blind.empty() ? events.error().message
                                           : folder + " is on " + std::string(blind) +
                                                 ", which does not tell of files that arrive");
      }
    }
    watch->table_folders_.insert(fs::hash_value(fs::path(folder)));
    TRUETRIAD_RETURN_IF_ERROR(watch->Scan(folder));
    return std::unique_ptr<OrderSource>(std::move(watch));
  }

  Status Look() override {
    if (events_) {
      for (const FolderEvents::Event& event : events_->Take()) {
        last_change_ = Clock::now();
        Handle(event);
        if (!events_) break;
      }
    }
    if (Clock::now() < next_look_) return {};
    if (!events_ || !failure_.empty()) {
      const Status status = Scan(options_.folder);
      const std::string failure = status ? "" : status.error().message;
      if (failure.empty() != failure_.empty())
        tell_(status ? options_.folder + " can be read again" : failure);
      failure_ = failure;
    }
    LookAtWaiting();
    if (IsIdle()) {
      // What is missing will not come; its run will say what that is.
      std::erase_if(waiting_, [&](const auto& item) {
        const bool is_given = item.second.lacks_file && !item.second.is_written;
        if (is_given) Give(item.first);
        return is_given;
      });
    }
    next_look_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(1e3 * LookS()));
    return {};
  }

  std::optional<Arrival> Next() override {
    for (std::size_t i = ready_.size(); i > 0; --i) {
      std::string log = std::move(ready_.front());
      ready_.pop_front();
      if (in_hand_.contains(log)) {
        ready_.push_back(std::move(log));  // It came again meanwhile.
        continue;
      }
      const std::optional<LogStamp> stamp = StampOf(log);
      if (!stamp) continue;
      Arrival arrival{.order = {.log = log}};
      const Status named = TakeSerial(options_.serial_pattern, &arrival.order);
      if (arrival.order.serial.empty()) {
        const std::hash<std::string> hash;
        const auto [first, is_new] = log_of_name_.try_emplace(hash(SerialOfName(log)), hash(log));
        arrival.order.shares_name = !is_new && first->second != hash(log);
      }
      if (done_.Has(arrival.order, *stamp)) continue;
      if (!named && named.error().code == ErrorCode::kInvalidValue) {
        tell_(named.error().message);  // No store can keep it.
        done_.Add(log, *stamp, "", {});
        continue;
      }
      if (!named) arrival.refusal = named.error();
      in_hand_.insert(log);
      return arrival;
    }
    return std::nullopt;
  }

  bool HasEnded() const override {
    // A log that nobody writes to is given at one of the next looks.
    return IsIdle() && std::all_of(waiting_.begin(), waiting_.end(), [](const auto& item) {
             return item.second.is_written;
           });
  }

  void Finish(const UnitRun& run) override {
    last_change_ = Clock::now();
    in_hand_.erase(run.log);
    done_.Add(run.log, {run.log_bytes, run.log_modified_ns}, run.serial, run.tags);
  }

  void Again(const UnitRun& run) override {
    in_hand_.erase(run.log);
    ready_.push_back(run.log);
  }

  std::vector<std::string> Left() const override {
    std::vector<std::string> notes;
    for (const auto& [log, state] : waiting_) {
      if (state.is_written) {
        notes.push_back(log + " is not calibrated: somebody still writes to it");
      } else if (state.lacks_file) {
        notes.push_back(log + " is not calibrated: it names files that are not there");
      }
    }
    return notes;
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Path = std::filesystem::path;

  /// How a look found a log.
  struct State {
    std::string text;         ///< What has to stay the same; empty: nobody has looked yet.
    bool is_written = false;  ///< Somebody writes to it, or to one of its files.
    bool lacks_file = false;  ///< One that it names is not there.
  };

  LogWatch(WatchOptions options, DoneLogs done, Tell tell)
      : options_(std::move(options)), done_(std::move(done)), tell_(std::move(tell)) {}

  double LookS() const { return events_ ? options_.look_s : options_.poll_s.value_or(kPollS); }

  void Handle(const FolderEvents::Event& event) {
    using Kind = FolderEvents::Kind;
    switch (event.kind) {
      case Kind::kWhole:
      case Kind::kAppeared: {
        std::error_code missing;
        if (fs::is_directory(event.path, missing)) {  // A link, which may lead to what is known.
          ScanAnew(options_.folder);
        } else {
          HandleFile(event.path, event.kind == Kind::kWhole);
        }
        return;
      }
      case Kind::kNewFolder:
        if (IsEntered(event.path)) ScanAnew(event.path);
        return;
      case Kind::kGone:
        if (event.path != fs::path(options_.folder)) return;
        failure_ = options_.folder + " is gone";
        tell_(failure_ + "; waiting for it to come back");
        return;
      case Kind::kLost:
        tell_("more files came at once than the system tells of; looking through " +
              options_.folder);
        ScanAnew(options_.folder);
        return;
    }
  }

  void HandleFile(const fs::path& file, bool is_whole) {
    // Of other files some recording.yaml may name one: that of its poses.
    const std::string log = LogOf(file);
    const bool is_log = IsTable(log) || fs::path(log).filename() == kManifestName;
    if (!is_log || IsLeftOut(file)) return;
    if (file.filename() == kManifestName) TakeFilesOf(log);
    const bool is_given_at_once = is_whole && log == file.string() && IsTable(file) &&
                                  table_folders_.contains(FolderHash(file));
    if (is_given_at_once) {
      Give(log);
    } else {
      waiting_.try_emplace(log);
    }
  }

  /// Takes all logs in a folder and below that have no run to be looked at. The status of reading
  /// the folder.
  Status Scan(const fs::path& folder) {
    Status full;
    const auto enters = [&](const fs::path& entered) {
      if (IsLeftOut(entered)) return false;
      if (!events_ || !full) return true;
      const Status watched = events_->Watch(entered);
      std::error_code missing;
      if (!watched && fs::exists(entered, missing)) full = watched;
      return true;
    };
    const Status status = ForEachLog(folder, enters, [&](const fs::path& log) {
      if (log.filename() == kManifestName) TakeFilesOf(log.string());
      const std::optional<LogStamp> stamp = StampOf(log.string());
      if (stamp && !IsDone(log.string(), *stamp)) waiting_.try_emplace(log.string());
    });
    if (!full) TurnToPolling(full.error().message);
    return status;
  }

  /// The same; what cannot be read is told, and tried again at every look.
  void ScanAnew(const fs::path& folder) {
    const Status status = Scan(folder);
    std::error_code missing;
    if (status || !failure_.empty() || !fs::exists(folder, missing)) return;
    failure_ = status.error().message;
    tell_(failure_);
  }

  /// Whether it is below `without`.
  bool IsLeftOut(const fs::path& path) const {
    if (options_.without.empty()) return false;
    const std::string whole = CanonicalPath(path);
    return whole == options_.without || whole.starts_with(options_.without + "/");
  }

  /// The recording.yaml that `file` belongs to; else `file`.
  std::string LogOf(const fs::path& file) const {
    if (file.filename() == kManifestName) return file.string();
    if (const auto found = manifest_of_.find(WholePath(file)); found != manifest_of_.end()) {
      const std::vector<std::string> files =
          FilesOf(found->second).value_or(std::vector<std::string>());
      // It may have been written anew since.
      for (const std::string& named : files) {
        if (WholePath(named) == found->first) return found->second;
      }
    }
    const fs::path manifest = file.parent_path() / kManifestName;
    std::error_code missing;
    const bool is_part =
        fs::exists(manifest, missing) && (!IsTable(file) || BelongsToManifest(file));
    return is_part ? manifest.string() : file.string();
  }

  /// Notes which files elsewhere belong to a recording.yaml.
  void TakeFilesOf(const std::string& manifest) {
    const std::string folder = WholePath(fs::path(manifest).parent_path());
    for (const std::string& file : FilesOf(manifest).value_or(std::vector<std::string>())) {
      const std::string whole = WholePath(file);
      if (fs::path(whole).parent_path() != folder) manifest_of_[whole] = manifest;
    }
  }

  bool IsDone(const std::string& log, const LogStamp& stamp) const {
    UnitOrder order{.log = log};
    // One that is not named as it should be is known by its log alone.
    (void)TakeSerial(options_.serial_pattern, &order).has_value();
    return done_.Has(order, stamp);
  }

  void LookAtWaiting() {
    folder_states_.clear();
    for (auto at = waiting_.begin(); at != waiting_.end();) {
      const auto item = at++;
      const std::string& log = item->first;
      const std::string whole = LogOf(log);
      if (whole != log) waiting_.try_emplace(whole);
      const std::optional<LogStamp> stamp = StampOf(log);
      if (whole != log || !stamp || IsDone(log, *stamp)) {
        waiting_.erase(item);
        continue;
      }
      State state = StateOf(log, *stamp);
      const bool has_stayed = state.text == item->second.text;
      if (has_stayed && !state.is_written && !state.lacks_file) {
        Give(log);
        waiting_.erase(item);
        continue;
      }
      if (!has_stayed) last_change_ = Clock::now();
      item->second = std::move(state);
    }
  }

  State StateOf(const std::string& log, const LogStamp& stamp) {
    const fs::path path = log;
    State state{.text = StampText(stamp), .is_written = IsBeingWritten(log)};
    if (path.filename() == kManifestName) {
      TakeFilesOf(log);
      // Where it cannot be read its run will say what is wrong.
      for (const std::string& file : FilesOf(log).value_or(std::vector<std::string>())) {
        std::error_code failure;
        if (!fs::exists(file, failure)) state.lacks_file = true;
        if (IsBeingWritten(file)) state.is_written = true;
      }
      return state;
    }
    if (table_folders_.contains(FolderHash(path))) return state;
    // The recording.yaml that this one belongs to may be on its way.
    const auto [folder, is_new] = folder_states_.try_emplace(path.parent_path());
    if (is_new) folder->second = StampText(StampOfFolder(path.parent_path()));
    state.text = folder->second;
    return state;
  }

  bool IsIdle() const {
    if (!options_.until_idle_s || !in_hand_.empty() || !ready_.empty()) return false;
    // What is seen for the first time is given at the look after the next.
    constexpr double kLooks = 3.0;
    const double idle_s = std::chrono::duration<double>(Clock::now() - last_change_).count();
    return idle_s > std::max(*options_.until_idle_s, kLooks * LookS());
  }

  void Give(const std::string& log) {
    last_change_ = Clock::now();
    const fs::path path = log;
    if (path.filename() != kManifestName) table_folders_.insert(FolderHash(path));
    ready_.push_back(log);
  }

  void TurnToPolling(const std::string& why) {
    events_.reset();
    options_.poll_s = options_.poll_s.value_or(kPollS);
    std::array<char, 64> often{};
    std::snprintf(often.data(), often.size(), "; looking every %g s instead", *options_.poll_s);
    tell_(why + often.data());
  }

  WatchOptions options_;
  DoneLogs done_;
  Tell tell_;
  std::unique_ptr<FolderEvents> events_;  ///< Null: looks for itself.
  std::map<std::string, State> waiting_;  ///< By log, how the last look found it.
  std::unordered_map<std::string, std::string> manifest_of_;  ///< By file, where it is elsewhere.
  std::map<Path, std::string> folder_states_;                 ///< As this look found them.
  std::deque<std::string> ready_;
  std::set<std::string> in_hand_;
  std::unordered_map<std::size_t, std::size_t> log_of_name_;  ///< Hashes of both.
  std::unordered_set<std::size_t> table_folders_;  ///< Hashes of those that have given a log.
  std::string failure_;                            ///< Why the folder cannot be read; or empty.
  Clock::time_point next_look_, last_change_ = Clock::now();
};

}  // namespace

Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell) {
  return LogWatch::Open(std::move(options), std::move(done), std::move(tell));
}

}  // namespace truetriad::fleet
