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

/// The files that a manifest names, as paths relative to the working directory; unset: the manifest
/// cannot be read. A manifest is read again only if its file has changed.
std::optional<std::vector<std::string>> FilesOf(const std::string& manifest);

/// Calls `on_log` for every log in a folder and its subfolders. A log is a recording.yaml, or a
/// table (*.csv, *.csv.gz, in upper or lower case) that no recording.yaml names; beside a
/// recording.yaml, the table must also have readings. Hidden and temporary files and results
/// (*.truetriad) are skipped. If several paths lead to a folder, it is entered once, and by a link
/// only if no other path leads there. `enters` decides whether a folder, the first included, is
/// entered. Files that vanish meanwhile are skipped. Error (bad input): a folder cannot be read;
/// the logs of all other folders were reported.
Status ForEachLog(const std::filesystem::path& folder,
                  const std::function<bool(const std::filesystem::path&)>& enters,
                  const std::function<void(const std::filesystem::path&)>& on_log);

/// The state of a log: its size and its time of modification.
struct LogStamp {
  std::int64_t bytes = 0, modified_ns = 0;

  bool operator==(const LogStamp&) const = default;
};

/// The state of a log; unset: it does not exist. For a manifest, `bytes` is the total size of the
/// manifest and all files that it names. `modified_ns` is the latest of their times in whole
/// seconds, plus a digest of all sizes and times in place of the nanoseconds.
std::optional<LogStamp> StampOf(const std::string& log);
/// The state of all tables of a folder and its recording.yaml.
LogStamp StampOfFolder(const std::filesystem::path& folder);

/// When a log was recorded (ISO 8601, UTC), and the source of this time (kRecordedBy). A time in
/// the future is replaced by the present; otherwise no later run could become current.
struct Recorded {
  std::string at;
  std::string_view by;
};
/// Takes the time at which the file was modified.
Recorded RecordedOf(const LogStamp& stamp);
/// Takes the clock of the recording; unset: the recording has no times, or its clock does not count
/// from 1970.
std::optional<Recorded> RecordedOf(const PoseSet& poses);

/// Whether a process has the file open for writing; false where the system does not report it
/// (network folders, another user's file).
bool IsBeingWritten(const std::string& file);

/// The logs that this program has already calibrated by one experiment, and each log's state then.
/// Memory holds a few 64-bit hashes for each log; if the names of two logs have the same hash, one
/// of the logs is calibrated again.
class DoneLogs {
 public:
  /// No logs.
  DoneLogs() = default;
  /// The logs whose last run is of `config_sha256`. Error (bad input): the store cannot be read.
  static Result<DoneLogs> In(Store& store, const std::string& config_sha256);

  /// `serial`, `tags`: of the log's run; `recorded`: the time that a list stated for the log.
  void Add(const std::string& log,
           const LogStamp& stamp,
           const std::string& serial,
           const Tags& tags,
           const std::string& recorded = "");
  /// Whether the last run of the order's log read the log in this state, and has the serial number,
  /// tags and time of measurement that the order states. What the order does not state is ignored.
  bool Has(const UnitOrder& order, const LogStamp& stamp) const;
  /// Has() for the log as it is at present.
  bool Has(const UnitOrder& order) const;

 private:
  std::unordered_map<std::size_t, std::vector<std::size_t>> logs_;  ///< By hash of the name.
};

/// The units that `words` name, in their order. A word is a log; a folder, with all its logs
/// (ForEachLog) by name; a pattern such as `line-3/*.csv`, with its files by name; or a list. A
/// list is CSV with a column `log` and optionally `serial`, `recorded` and tags (`lot`, `slot`, …);
/// its paths are relative to the list. `serial_pattern` describes file names: {serial} stands for
/// the serial number, * for any text; empty: names give no serial number. Errors (bad input): a
/// name does not exist; a folder has no logs or cannot be read; a list is malformed or names no log
/// or a missing one; a log is named twice; a name does not match the pattern or is not UTF-8. Error
/// (usage): there are no words, or the pattern has no {serial}.
Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern);

/// The text without leading and trailing blanks.
std::string Trimmed(const std::string& text);

/// Error (usage): a pattern without {serial}. An empty pattern is valid.
Status CheckSerialPattern(const std::string& pattern);

/// Error (usage): the experiment of `plan` states a serial number that several of `units` would
/// get.
Status CheckSerials(const WorkPlan& plan, const std::vector<UnitOrder>& units);
/// CheckSerials for a watch, whose units are not known yet. No error if the pattern gives each unit
/// its own serial number.
Status CheckSerialsToCome(const WorkPlan& plan, const std::string& serial_pattern);

/// Sets a unit's serial number from its log's name, unless it is known or `pattern` is empty.
/// Errors (bad input): the name does not match, contradicts a known number, or is not UTF-8.
Status TakeSerial(const std::string& pattern, UnitOrder* unit);

/// The units of shard `index` of `count`. The shard of a unit follows from a hash of its place
/// (UnitOrder), so it does not depend on the other units.
std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count);

}  // namespace truetriad::fleet
