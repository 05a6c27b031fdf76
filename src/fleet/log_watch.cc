// SPDX-License-Identifier: Apache-2.0
#include "fleet/log_watch.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
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

}  // namespace

Result<std::unique_ptr<FolderEvents>> FolderEvents::Open() {
  const int stream = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  if (stream < 0) {
    return Error(ErrorCode::kSystemFailure,
                 std::string("folders cannot be watched: ") + std::strerror(errno));
  }
  return std::unique_ptr<FolderEvents>(new FolderEvents(stream));
}

FolderEvents::~FolderEvents() { close(stream_); }

Status FolderEvents::Watch(const fs::path& folder) {
  const int watch = inotify_add_watch(stream_, folder.c_str(), kWatched);
  if (watch >= 0) {
    folders_[watch] = folder;
    return {};
  }
  if (errno == ENOSPC) {
    return Error(ErrorCode::kSystemFailure,
                 {folder.string()},
                 "is one folder more than this system watches (" + std::to_string(folders_.size()) +
                     " are); raise fs.inotify.max_user_watches");
  }
  return Error(ErrorCode::kUnreadableFile,
               {folder.string()},
               std::string("cannot be watched: ") + std::strerror(errno));
}

void FolderEvents::Forget(const fs::path& folder) {
  const std::string below = folder.string() + "/";
  std::erase_if(folders_, [&](const auto& item) {
    const bool is_within = item.second == folder || item.second.string().starts_with(below);
    if (is_within) inotify_rm_watch(stream_, item.first);
    return is_within;
  });
}

std::vector<FolderEvents::Event> FolderEvents::Take() {
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

namespace {

namespace fs = std::filesystem;

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

}  // namespace

LogWatch::LogWatch(WatchOptions options, DoneLogs done, Tell tell)
    : options_(std::move(options)), done_(std::move(done)), tell_(std::move(tell)) {}

Result<std::unique_ptr<LogWatch>> LogWatch::Open(WatchOptions options, DoneLogs done, Tell tell) {
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
  return watch;
}

double LogWatch::LookS() const {
  return events_ ? options_.look_s : options_.poll_s.value_or(kPollS);
}

Status LogWatch::Look() {
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

void LogWatch::Handle(const FolderEvents::Event& event) {
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
      tell_("more files came at once than the system tells of; looking through " + options_.folder);
      ScanAnew(options_.folder);
      return;
  }
}

void LogWatch::ScanAnew(const fs::path& folder) {
  const Status status = Scan(folder);
  std::error_code missing;
  if (status || !failure_.empty() || !fs::exists(folder, missing)) return;
  failure_ = status.error().message;
  tell_(failure_);
}

void LogWatch::HandleFile(const fs::path& file, bool is_whole) {
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

Status LogWatch::Scan(const fs::path& folder) {
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

bool LogWatch::IsLeftOut(const fs::path& path) const {
  if (options_.without.empty()) return false;
  const std::string whole = CanonicalPath(path);
  return whole == options_.without || whole.starts_with(options_.without + "/");
}

void LogWatch::TakeFilesOf(const std::string& manifest) {
  const std::string folder = WholePath(fs::path(manifest).parent_path());
  for (const std::string& file : FilesOf(manifest).value_or(std::vector<std::string>())) {
    const std::string whole = WholePath(file);
    if (fs::path(whole).parent_path() != folder) manifest_of_[whole] = manifest;
  }
}

std::string LogWatch::LogOf(const fs::path& file) const {
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
  const bool is_part = fs::exists(manifest, missing) && (!IsTable(file) || BelongsToManifest(file));
  return is_part ? manifest.string() : file.string();
}

bool LogWatch::IsDone(const std::string& log, const LogStamp& stamp) const {
  UnitOrder order{.log = log};
  // One that is not named as it should be is known by its log alone.
  (void)TakeSerial(options_.serial_pattern, &order).has_value();
  return done_.Has(order, stamp);
}

void LogWatch::LookAtWaiting() {
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

LogWatch::State LogWatch::StateOf(const std::string& log, const LogStamp& stamp) {
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

void LogWatch::Give(const std::string& log) {
  last_change_ = Clock::now();
  const fs::path path = log;
  if (path.filename() != kManifestName) table_folders_.insert(FolderHash(path));
  ready_.push_back(log);
}

std::optional<Arrival> LogWatch::Next() {
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

bool LogWatch::IsIdle() const {
  if (!options_.until_idle_s || !in_hand_.empty() || !ready_.empty()) return false;
  // What is seen for the first time is given at the look after the next.
  constexpr double kLooks = 3.0;
  const double idle_s = std::chrono::duration<double>(Clock::now() - last_change_).count();
  return idle_s > std::max(*options_.until_idle_s, kLooks * LookS());
}

bool LogWatch::HasEnded() const {
  // A log that nobody writes to is given at one of the next looks.
  return IsIdle() && std::all_of(waiting_.begin(), waiting_.end(), [](const auto& item) {
           return item.second.is_written;
         });
}

std::vector<std::string> LogWatch::Left() const {
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

void LogWatch::Again(const UnitRun& run) {
  in_hand_.erase(run.log);
  ready_.push_back(run.log);
}

void LogWatch::Finish(const UnitRun& run) {
  last_change_ = Clock::now();
  in_hand_.erase(run.log);
  done_.Add(run.log, {run.log_bytes, run.log_modified_ns}, run.serial, run.tags);
}

void LogWatch::TurnToPolling(const std::string& why) {
  events_.reset();
  options_.poll_s = options_.poll_s.value_or(kPollS);
  std::array<char, 64> often{};
  std::snprintf(often.data(), often.size(), "; looking every %g s instead", *options_.poll_s);
  tell_(why + often.data());
}

}  // namespace truetriad::fleet
