// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "fleet/fleet_run.h"
#include "fleet/log_files.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

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
    std::filesystem::path path = {};
  };

  /// Error (bad input): the system has no more of them.
  static Result<std::unique_ptr<FolderEvents>> Open();
  ~FolderEvents();
  FolderEvents(const FolderEvents&) = delete;
  FolderEvents& operator=(const FolderEvents&) = delete;

  /// Tells of `folder` from now on, not of those below it. Error (bad input): it cannot be watched,
  /// or the system watches as many as it is set to.
  Status Watch(const std::filesystem::path& folder);
  /// What has happened since.
  std::vector<Event> Take();

 private:
  explicit FolderEvents(int stream) : stream_(stream) {}
  /// Forgets a folder that has another name now, and those below it.
  void Forget(const std::filesystem::path& folder);

  int stream_;
  std::unordered_map<int, std::filesystem::path> folders_;  ///< By watch.
};

/// "NFS", "FUSE", …: a file system that says nothing of what other machines, or programs behind it,
/// write to `folder`. Else empty.
std::string_view FileSystemWithoutEvents(const std::string& folder);

/// What is watched, and how.
struct WatchOptions {
  std::string folder = {};
  std::string without = {};         ///< A folder whose files are results, no logs; or empty.
  std::string serial_pattern = {};  ///< As ListUnits.
  double look_s = 1.0;              ///< Between looks at what events do not say all about.
  /// Look so often instead of being told; set where nothing tells.
  std::optional<double> poll_s = {};
  /// Ends when nothing has happened for so long; what is still incomplete is given as it is.
  std::optional<double> until_idle_s = {};
};

/// Logs of a folder and below as they arrive, and those that are there without a run; a log that
/// arrives again changed is given again. Keeps in memory what waits, a few numbers of each log that
/// is done, the names of folders, and those of tables that a recording.yaml elsewhere names.
///
/// Given at once: a table that was closed after writing or renamed. When nobody writes to it and
/// two looks (`look_s` or `poll_s` apart) have found it the same: what was there already or was
/// linked, and any table where no event tells. In a folder that has not had a log yet the whole
/// folder must have stayed so, since a recording.yaml may follow; that is given when it and all
/// files that it names are there and have stayed so.
class LogWatch : public OrderSource {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// Error (bad input): the folder or one below cannot be read. Error (usage): the serial pattern.
  static Result<std::unique_ptr<LogWatch>> Open(WatchOptions options, DoneLogs done, Tell tell);

  Status Look() override;
  std::optional<Arrival> Next() override;
  bool HasEnded() const override;
  void Finish(const UnitRun& run) override;
  void Again(const UnitRun& run) override;
  std::vector<std::string> Left() const override;

 private:
  using Clock = std::chrono::steady_clock;
  using Path = std::filesystem::path;

  /// How a look found a log.
  struct State {
    std::string text;         ///< What has to stay the same; empty: nobody has looked yet.
    bool is_written = false;  ///< Somebody writes to it, or to one of its files.
    bool lacks_file = false;  ///< One that it names is not there.
  };

  LogWatch(WatchOptions options, DoneLogs done, Tell tell);
  double LookS() const;
  void Handle(const FolderEvents::Event& event);
  void HandleFile(const Path& file, bool is_whole);
  /// Takes all logs in a folder and below that have no run to be looked at. The status of reading
  /// the folder.
  Status Scan(const Path& folder);
  /// The same; what cannot be read is told, and tried again at every look.
  void ScanAnew(const Path& folder);
  /// Whether it is below `without`.
  bool IsLeftOut(const Path& path) const;
  /// The recording.yaml that `file` belongs to; else `file`.
  std::string LogOf(const Path& file) const;
  /// Notes which files elsewhere belong to a recording.yaml.
  void TakeFilesOf(const std::string& manifest);
  bool IsDone(const std::string& log, const LogStamp& stamp) const;
  void LookAtWaiting();
  State StateOf(const std::string& log, const LogStamp& stamp);
  bool IsIdle() const;
  void Give(const std::string& log);
  void TurnToPolling(const std::string& why);

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

}  // namespace truetriad::fleet
