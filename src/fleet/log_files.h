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

/// Where this is in a folder, it stands for the tables that it names.
inline constexpr std::string_view kManifestName = "recording.yaml";

/// `name` ends in `ending`, in large or small letters.
bool EndsIn(const std::string& name, std::string_view ending);

/// A path by which two names of a file are known to be the same, but for links.
std::string WholePath(const std::filesystem::path& path);
/// By which a file or folder is known, whatever links lead to it.
std::string CanonicalPath(const std::filesystem::path& path);

/// The files that a manifest names, as seen from here; unset: it cannot be read. Reads it again
/// only if it was written since.
std::optional<std::vector<std::string>> FilesOf(const std::string& manifest);

/// Every log in a folder and below: recording.yaml, and tables (*.csv, *.csv.gz, in large or small
/// letters) that no recording.yaml there names, nor stands beside unless they have readings.
/// Nothing that is hidden or being written under another name, and no results (*.truetriad). A
/// folder with several names is entered once, by a link only if by nothing else. `enters` is asked
/// of each (the first, too) before it is read. What vanishes meanwhile is left out. Error (bad
/// input): the first of the folders that cannot be read; logs of all others have been given.
Status ForEachLog(const std::filesystem::path& folder,
                  const std::function<bool(const std::filesystem::path&)>& enters,
                  const std::function<void(const std::filesystem::path&)>& on_log);

/// By which a log is known to be as it was: its bytes and when it was last written.
struct LogStamp {
  std::int64_t bytes = 0, modified_ns = 0;

  bool operator==(const LogStamp&) const = default;
};

/// Of a manifest: with all files that it names, the bytes of all, and the second of the last
/// time; the digits below that are a digest of the sizes and times of all. Unset: there is no such
/// file.
std::optional<LogStamp> StampOf(const std::string& log);
/// Of all tables of a folder and its recording.yaml.
LogStamp StampOfFolder(const std::filesystem::path& folder);

/// When a log was recorded, ISO 8601, UTC, and which of kRecordedBy says so. A clock that is ahead
/// says no more than that it was before now: what comes later would not count.
struct Recorded {
  std::string at;
  std::string_view by;
};
/// By the file's time.
Recorded RecordedOf(const LogStamp& stamp);
/// By the recording's own clock; unset: it has none, or one that does not count from 1970.
std::optional<Recorded> RecordedOf(const PoseSet& poses);

/// Whether some process has the file open to write; false where the system does not say (network
/// folders, another user's file).
bool IsBeingWritten(const std::string& file);

/// Which logs have a run by one experiment and this program, and how they were then. Keeps a few
/// numbers a log; should two have one number (of 2^64), one of them is calibrated again.
class DoneLogs {
 public:
  /// Nothing yet.
  DoneLogs() = default;
  /// What the store has. Error (bad input): it cannot be read.
  static Result<DoneLogs> In(Store& store, const std::string& config_sha256);

  /// `serial`, `tags`: of its run; `recorded`: the time that a list stated for it.
  void Add(const std::string& log,
           const LogStamp& stamp,
           const std::string& serial,
           const Tags& tags,
           const std::string& recorded = "");
  /// The last run of the order's log was of this state of it, and has the serial number, tags and
  /// time of measurement that the order states. Of those that it does not state any do: they label
  /// what is run.
  bool Has(const UnitOrder& order, const LogStamp& stamp) const;
  /// The same of the log as it is now.
  bool Has(const UnitOrder& order) const;

 private:
  std::unordered_map<std::size_t, std::vector<std::size_t>> logs_;  ///< Hashes of what each is.
};

/// The units that `words` name: logs; folders, with every log in them and below (ForEachLog);
/// patterns such as `line-3/*.csv`; and lists, CSV with a column `log` and perhaps `serial`,
/// `recorded` and tags (`lot`, `slot`, …), paths as seen from their folder. Each once, in the order
/// of their names; those of a list as there. `serial_pattern`: how a file is named, with {serial}
/// for that and * for anything else; empty: nothing is taken from names. Errors (bad input): a name
/// that is none, a folder without a log or that cannot be read, a list that is malformed, names no
/// log or one that is not there, a log that is there twice, a name that does not match the pattern
/// or is no UTF-8. Error (usage): no words, a pattern without {serial}.
Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern);

/// Without blanks in front and behind, which nobody sees.
std::string Trimmed(const std::string& text);

/// Error (usage): a pattern of serial numbers without {serial}. None: empty.
Status CheckSerialPattern(const std::string& pattern);

/// Error (usage): the experiment of `plan` states a serial number, and it would be that of more
/// than one of `units`.
Status CheckSerials(const WorkPlan& plan, const std::vector<UnitOrder>& units);
/// The same of units that are still to come: however many.
Status CheckSerialsToCome(const WorkPlan& plan, const std::string& serial_pattern);

/// Takes a unit's serial number from its log's name, unless it is known or `pattern` is empty.
/// Errors (bad input): the name does not match, is of another unit than is known, or is no UTF-8.
Status TakeSerial(const std::string& pattern, UnitOrder* unit);

/// The part of `units` that shard `index` of `count` does: by a hash of their places, so that each
/// belongs to one shard whatever else is in the list.
std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count);

}  // namespace truetriad::fleet
