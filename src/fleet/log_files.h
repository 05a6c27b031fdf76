// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "fleet/store.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad::fleet {

/// A file of this name in a folder stands for the tables that it names.
inline constexpr std::string_view kManifestName = "recording.yaml";

/// Whether `name` ends in `ending`, in upper or lower case.
bool EndsIn(const std::string& name, std::string_view ending);

/// The normalised absolute path, equal for all spellings of a file's name. Links are not resolved.
std::string WholePath(const std::filesystem::path& path);
/// A path that is the same for all links to a file or folder.
std::string CanonicalPath(const std::filesystem::path& path);

/// The files that a manifest names, relative to the working directory; unset: it cannot be read.
/// The manifest is read again only if it has been written since.
std::optional<std::vector<std::string>> FilesOf(const std::string& manifest);

/// Calls `on_log` for every log in a folder and below: each recording.yaml, and each table (*.csv,
/// *.csv.gz, in upper or lower case) that no recording.yaml names (beside a recording.yaml only
/// tables with readings). Hidden and temporary files and results (*.truetriad) are skipped. A
/// folder with several names is entered once, by a link only if there is no other way. `enters`
/// decides whether a folder, the first included, is entered. Files that vanish meanwhile are
/// skipped. Error (bad input): the first folder that cannot be read, after the logs of all others.
Status ForEachLog(const std::filesystem::path& folder,
                  const std::function<bool(const std::filesystem::path&)>& enters,
                  const std::function<void(const std::filesystem::path&)>& on_log);

/// The state of a log: its size and its time of modification.
struct LogStamp {
  std::int64_t bytes = 0, modified_ns = 0;

  bool operator==(const LogStamp&) const = default;
};

/// The state of a log. For a manifest and all files that it names: the total size, and the latest
/// time in whole seconds, below which a digest of all sizes and times takes the place of the
/// nanoseconds. Unset: the file does not exist.
std::optional<LogStamp> StampOf(const std::string& log);
/// The state of all tables of a folder and its recording.yaml.
LogStamp StampOfFolder(const std::filesystem::path& folder);

/// When a log was recorded, ISO 8601, UTC, and by which of kRecordedBy. A time in the future is
/// replaced by now, since later runs would not count otherwise.
struct Recorded {
  std::string at;
  std::string_view by;
};
/// From the time of the file.
Recorded RecordedOf(const LogStamp& stamp);
/// From the clock of the recording; unset: there is no clock, or one that does not count from 1970.
std::optional<Recorded> RecordedOf(const PoseSet& poses);

/// Whether a process has the file open for writing; false where the system does not report it
/// (network folders, another user's file).
bool IsBeingWritten(const std::string& file);

/// The logs that have a run of one experiment and this program, and their state at that run. Keeps
/// a few hashes for each log; should two logs share a hash (of 2^64), one is calibrated again.
class DoneLogs {
 public:
  /// No logs.
  DoneLogs() = default;
  /// The logs of the store. Error (bad input): it cannot be read.
  static Result<DoneLogs> In(Store& store, const std::string& config_sha256);

  /// `serial`, `tags`: of the log's run; `recorded`: the time that a list stated for the log.
  void Add(const std::string& log,
           const LogStamp& stamp,
           const std::string& serial,
           const Tags& tags,
           const std::string& recorded = "");
  /// Whether the last run of the order's log was of this state, and has the serial number, tags and
  /// time of measurement that the order states. Those that it does not state may have any value.
  bool Has(const UnitOrder& order, const LogStamp& stamp) const;
  /// The same for the present state of the log.
  bool Has(const UnitOrder& order) const;

 private:
  std::unordered_map<std::size_t, std::vector<std::size_t>> logs_;  ///< Hashes of states.
};

/// The units named by `words`: logs; folders, with every log in them and below (ForEachLog);
/// patterns such as `line-3/*.csv`; and lists, CSV with a column `log` and optionally `serial`,
/// `recorded` and tags (`lot`, `slot`, …), with paths relative to the list. Each unit comes once,
/// ordered by name; those of a list in its order. `serial_pattern`: file names with {serial} for
/// the serial number and * for anything; empty: names give no serial number. Errors (bad input): a
/// name that does not exist, a folder without logs or unreadable, a list that is malformed or names
/// no log or a missing one, a log named twice, a name that does not match the pattern or is not
/// UTF-8. Error (usage): no words, a pattern without {serial}.
Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern);

/// The text without leading and trailing blanks.
std::string Trimmed(const std::string& text);

/// Error (usage): a pattern without {serial}. An empty pattern is valid.
Status CheckSerialPattern(const std::string& pattern);

/// Error (usage): the experiment of `plan` states a serial number, which more than one of `units`
/// would get.
Status CheckSerials(const WorkPlan& plan, const std::vector<UnitOrder>& units);
/// The same for units to come, whose number is unknown.
Status CheckSerialsToCome(const WorkPlan& plan, const std::string& serial_pattern);

/// Sets a unit's serial number from its log's name, unless it is known or `pattern` is empty.
/// Errors (bad input): the name does not match, contradicts a known number, or is not UTF-8.
Status TakeSerial(const std::string& pattern, UnitOrder* unit);

/// The units of shard `index` of `count`, by a hash of their places, so that the shard of a unit
/// does not depend on the rest of the list.
std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count);

}  // namespace truetriad::fleet
