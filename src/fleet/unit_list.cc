// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <glob.h>

#include "base/spelling.h"
#include "base/utf8.h"
#include "fleet/fields.h"
#include "fleet/log_files.h"
#include "io/text_file.h"
#include "line/line_data.h"
#include "truetriad/config/experiment.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// A line of CSV.
struct CsvLine {
  std::vector<std::string> texts;  ///< Without quotes.
  bool ends_in_quotes = false;     ///< A quote is left open.
};

CsvLine FieldsOf(std::string_view line) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (is_quoted && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (line[i] == '"') {
      is_quoted = !is_quoted;
    } else if (line[i] == ',' && !is_quoted) {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  return {std::move(fields), is_quoted};
}

/// Reads a line and removes a carriage return and a byte order mark.
bool NextLine(std::ifstream* file, std::string* line) {
  if (!std::getline(*file, *line)) return false;
  if (line->ends_with('\r')) line->pop_back();
  if (line->starts_with("\xEF\xBB\xBF")) line->erase(0, 3);
  return true;
}

/// The columns that a list may have.
std::vector<std::string_view> ListColumns() {
  std::vector<std::string_view> columns = {"log", "serial", "recorded"};
  for (const std::string_view tag : TagNames()) columns.push_back(tag);
  return columns;
}

/// Whether a CSV is a list of logs: it has a column named `log`.
bool IsList(const fs::path& path) {
  if (!EndsIn(path.filename().string(), ".csv")) return false;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (NextLine(&file, &line) && (line.empty() || line.starts_with('#'))) {
  }
  const std::vector<std::string> header = FieldsOf(line).texts;
  // With a misspelled `log`, such as `Log`, a CSV is a list with an error rather than a log.
  return std::any_of(header.begin(), header.end(), [](const std::string& field) {
    std::string word;
    for (const char c : field) {
      if (c == ';' || c == '\t') break;
      if (c != ' ') word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return word == "log";
  });
}

Status CheckHeader(const std::vector<std::string>& header, const FilePlace& place) {
  if (header.front().find_first_of(";\t") != std::string::npos) {
    return Error(
        ErrorCode::kUnknownColumn,
        place,
        "`" + header.front() + "` is not a valid header of a list: separate its columns by commas");
  }
  const std::vector<std::string_view> known = ListColumns();
  for (auto column = header.begin(); column != header.end(); ++column) {
    if (std::find(known.begin(), known.end(), *column) == known.end()) {
      return Error(ErrorCode::kUnknownColumn,
                   place,
                   "column `" + *column + "` is unknown" + DidYouMean(*column, known) +
                       "; a list has log, serial, recorded and tags");
    }
    if (std::find(header.begin(), column, *column) != column) {
      return Error(ErrorCode::kDuplicateColumn,
                   place,
                   "column `" + *column + "` occurs twice; leave one out");
    }
  }
  return {};
}

/// The position of a log relative to a folder, or its full path if it is elsewhere.
std::string PlaceIn(const fs::path& folder, const fs::path& log) {
  const fs::path place = fs::path(WholePath(log)).lexically_relative(WholePath(folder / "."));
  return place.empty() || *place.begin() == ".." ? WholePath(log) : place.generic_string();
}

/// The place of a log that is named directly: FOLDER/FILE, without the folders above it.
std::string PlaceOfLog(const fs::path& log) {
  const fs::path whole = WholePath(log);
  return (whole.parent_path().filename() / whole.filename()).generic_string();
}

/// The time of measurement in a line of a list. Error: it is not a time, or it is in the future:
/// then no later run could become current.
Result<std::string> RecordedIn(const std::string& text, const FilePlace& place) {
  constexpr double kDayS = 86400.0;  // A clock may have another time zone.
  const double seconds = line::SecondsOf(text);
  if (std::isnan(seconds)) {
    return Error(
        ErrorCode::kInvalidValue,
        place,
        "recorded is `" + text +
            "`; expected the time at which the unit was measured, as in 2026-11-24T06:00:00Z or "
            "2026-11-24T07:00+01:00");
  }
  if (seconds > static_cast<double>(std::time(nullptr)) + kDayS) {
    return Error(
        ErrorCode::kValueOutOfRange,
        place,
        "recorded is `" + text + "`, which is in the future; correct it, or this computer's clock");
  }
  return line::MomentOf(static_cast<std::int64_t>(seconds));
}

/// The unit in a line of a list.
Result<UnitOrder> UnitOfLine(const std::vector<std::string>& header,
                             const std::vector<std::string>& fields,
                             const FilePlace& place) {
  if (fields.size() != header.size()) {
    return Error(ErrorCode::kWrongFieldCount,
                 place,
                 "has " + std::to_string(fields.size()) + " fields; expected " +
                     std::to_string(header.size()));
  }
  UnitOrder unit;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string text = Trimmed(fields[i]);
    if (header[i] == "log" && !text.empty()) {
      const fs::path folder = fs::path(place.file).parent_path();
      unit.log = (folder / fields[i]).lexically_normal().string();
      unit.place = PlaceIn(folder, unit.log);
    } else if (header[i] == "serial" && !text.empty()) {
      unit.serial = text;
      unit.serial_from = place.Text();
    } else if (header[i] == "recorded" && !text.empty()) {
      TRUETRIAD_ASSIGN_OR_RETURN(unit.recorded, RecordedIn(text, place));
    } else {
      SetTag(header[i], text, &unit.tags);
    }
  }
  if (!unit.log.empty()) return unit;
  return Error(ErrorCode::kInvalidValue, place, "names no log; fill in the column `log`");
}

Error MissingLogs(const FilePlace& place, const std::string& first, std::size_t count) {
  return Error(
      ErrorCode::kUnreadableFile,
      place,
      "names the log " + first + ", which does not exist" +
          (count == 1 ? ""
                      : " (further lines with missing logs: " + std::to_string(count - 1) + ")") +
          "; correct the column `log`, or leave such lines out");
}

Status AddList(const fs::path& path, std::vector<UnitOrder>* units) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::string> header;
  const std::size_t before = units->size();
  FilePlace place{path.string()};
  std::string missing;  // The first missing log, and its place.
  FilePlace missing_place;
  std::size_t missing_count = 0;
  for (std::string line; NextLine(&file, &line);) {
    ++place.line;
    if (line.empty() || line.starts_with('#')) continue;
    if (!IsUtf8(line)) {
      return Error(ErrorCode::kWrongFormat, place, "is not UTF-8; save the list as UTF-8");
    }
    CsvLine fields = FieldsOf(line);
    if (fields.ends_in_quotes) {
      return Error(ErrorCode::kWrongFormat,
                   place,
                   "a quotation mark is not closed; close it, and double each quotation mark "
                   "inside a field");
    }
    if (header.empty()) {
      TRUETRIAD_RETURN_IF_ERROR(CheckHeader(fields.texts, place));
      header = std::move(fields.texts);
      continue;
    }
    TRUETRIAD_ASSIGN_OR_RETURN(UnitOrder unit, UnitOfLine(header, fields.texts, place));
    std::error_code failure;
    if (!fs::is_regular_file(unit.log, failure) && ++missing_count == 1) {
      missing = unit.log;
      missing_place = place;
    }
    units->push_back(std::move(unit));
  }
  // A unit without a log was not measured, so it can have no run.
  if (missing_count > 0) return MissingLogs(missing_place, missing, missing_count);
  if (units->size() > before) return {};
  return Error(ErrorCode::kNoReadings, {path.string()}, "is a list in which no line names a log");
}

/// Adds the logs in a folder and below, ordered by name.
Status AddFolder(const fs::path& folder, std::vector<UnitOrder>* units) {
  std::vector<std::string> logs;
  TRUETRIAD_RETURN_IF_ERROR(ForEachLog(
      folder,
      [](const fs::path&) { return true; },
      [&](const fs::path& log) { logs.push_back(log.string()); }));
  std::sort(logs.begin(), logs.end());
  for (std::string& log : logs) {
    std::string place = PlaceIn(folder, log);
    units->push_back({.log = std::move(log), .place = std::move(place)});
  }
  if (!logs.empty()) return {};
  return Error(ErrorCode::kNoReadings,
               {folder.string()},
               "has no log; expected *.csv, *.csv.gz, or folders with a recording.yaml");
}

Status AddWord(const std::string& word, std::vector<UnitOrder>* units) {
  std::error_code failure;
  if (fs::is_directory(word, failure)) return AddFolder(word, units);
  if (fs::exists(word, failure)) {
    // Opening a pipe would wait for a writer.
    if (!fs::is_regular_file(word, failure)) {
      return Error(ErrorCode::kUnreadableFile, {word}, "is neither a file nor a folder");
    }
    if (IsList(word)) return AddList(word, units);
    units->push_back({.log = word, .place = PlaceOfLog(word)});
    return {};
  }
  const fs::path folder = fs::path(word.substr(0, word.find_first_of("*?["))).parent_path();
  if (!folder.empty() && !fs::exists(folder, failure) && !failure) {
    return Error(ErrorCode::kUnreadableFile, {word}, "there is no folder " + folder.string());
  }
  glob_t found{};
  const int code = glob(word.c_str(), GLOB_ERR, nullptr, &found);  // Sorted by name.
  if (code == GLOB_ABORTED) {
    globfree(&found);
    return Error(ErrorCode::kUnreadableFile,
                 {word},
                 "a folder of this pattern cannot be read; check its permissions");
  }
  std::vector<std::string> names(found.gl_pathv, found.gl_pathv + (code == 0 ? found.gl_pathc : 0));
  globfree(&found);
  if (names.empty()) {
    return Error(ErrorCode::kUnreadableFile,
                 {word},
                 "there is no such log, list or folder, and no file matches this pattern");
  }
  for (const std::string& name : names) TRUETRIAD_RETURN_IF_ERROR(AddWord(name, units));
  return {};
}

/// Whether `name` matches `pattern`, in which `*` stands for any text.
bool Matches(std::string_view name, std::string_view pattern) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return name == pattern;
  if (!name.starts_with(pattern.substr(0, star))) return false;
  for (std::size_t at = star; at <= name.size(); ++at) {
    if (Matches(name.substr(at), pattern.substr(star + 1))) return true;
  }
  return false;
}

constexpr std::string_view kSerialMark = "{serial}";

/// The shortest text for {serial} in `name`; unset: no match.
std::optional<std::string> SerialIn(std::string_view name, std::string_view pattern) {
  const std::size_t mark = pattern.find(kSerialMark);
  const std::string_view before = pattern.substr(0, mark),
                         after = pattern.substr(mark + kSerialMark.size());
  for (std::size_t begin = 0; begin < name.size(); ++begin) {
    if (!Matches(name.substr(0, begin), before)) continue;
    for (std::size_t size = 1; begin + size <= name.size(); ++size) {
      if (Matches(name.substr(begin + size), after)) return std::string(name.substr(begin, size));
    }
  }
  return std::nullopt;
}

/// Error (usage): the experiment of `plan` states a serial number, which several units would get;
/// `whose` names these units in the message.
Status RefuseSerial(const WorkPlan& plan, const std::string& whose) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment, ExperimentOfAll(plan));
  if (experiment.serial.empty()) return {};
  return AtItsKey(
      experiment,
      Error(ErrorCode::kInvalidExperiment,
            "device.serial is `" + experiment.serial + "`, which would apply to " + whose +
                "; leave it out (--set='device.serial=\"\"'), or say which serial "
                "number each log has, in a list or by --serial={serial}-*.csv")
          .About("device.serial"));
}

/// Marks units whose log has the same name as another log, so the name is no serial number.
void MarkSharedNames(std::vector<UnitOrder>* units) {
  std::map<std::string, int> counts;
  for (const UnitOrder& unit : *units) {
    if (unit.serial.empty()) ++counts[SerialOfName(unit.log)];
  }
  for (UnitOrder& unit : *units) {
    unit.shares_name = unit.serial.empty() && counts[SerialOfName(unit.log)] > 1;
  }
}

}  // namespace

std::string Trimmed(const std::string& text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  return first == text.npos ? "" : text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

Status CheckSerialPattern(const std::string& pattern) {
  if (pattern.empty() || pattern.find(kSerialMark) != std::string::npos) return {};
  return Error(
      ErrorCode::kInvalidArgument,
      "--serial=" + pattern +
          ": expected a pattern of file names that contains {serial}, as in {serial}-*.csv");
}

Status CheckSerials(const WorkPlan& plan, const std::vector<UnitOrder>& units) {
  const auto unnamed = std::count_if(
      units.begin(), units.end(), [](const UnitOrder& unit) { return unit.serial.empty(); });
  if (unnamed < 2) return {};
  return RefuseSerial(plan, std::to_string(unnamed) + " logs");
}

Status CheckSerialsToCome(const WorkPlan& plan, const std::string& serial_pattern) {
  if (!serial_pattern.empty()) return {};
  return RefuseSerial(plan, "every log that comes");
}

Status TakeSerial(const std::string& pattern, UnitOrder* unit) {
  if (!IsUtf8(unit->log)) {
    return Error(ErrorCode::kInvalidValue,
                 "a log's name is not UTF-8, so no store can keep it; rename the log");
  }
  if (pattern.empty()) return {};
  fs::path path = unit->log;
  if (path.filename() == kManifestName) path = path.parent_path();
  // The file's ending is not part of the serial number if the pattern ends in {serial}.
  const bool ends_with_serial = pattern.ends_with(kSerialMark);
  const std::optional<std::string> serial =
      SerialIn(ends_with_serial ? SerialOfName(unit->log) : path.filename().string(), pattern);
  if (!unit->serial.empty()) {
    if (!serial || *serial == unit->serial) return {};
    return Error(ErrorCode::kOtherDevice,
                 {unit->serial_from},
                 "states serial number `" + unit->serial + "`, but --serial=" + pattern +
                     " gives " + unit->log + " the number `" + *serial +
                     "`; correct the wrong one");
  }
  if (!serial) {
    return Error(
        ErrorCode::kDoesNotMatch, {unit->log}, "does not match the pattern --serial=" + pattern);
  }
  unit->serial = *serial;
  unit->serial_from = "--serial=" + pattern;
  return {};
}

Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSerialPattern(serial_pattern));
  if (words.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "no log is named; expected logs, folders with logs, patterns or lists");
  }
  std::vector<UnitOrder> units;
  for (const std::string& word : words) TRUETRIAD_RETURN_IF_ERROR(AddWord(word, &units));
  std::set<std::string> seen;
  for (UnitOrder& unit : units) {
    TRUETRIAD_RETURN_IF_ERROR(TakeSerial(serial_pattern, &unit));
    if (!seen.insert(WholePath(unit.log)).second) {
      return Error(
          ErrorCode::kDuplicateKey, {unit.log}, "is named twice; name each log of a fleet once");
    }
  }
  MarkSharedNames(&units);
  return units;
}

std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count) {
  std::erase_if(units, [&](const UnitOrder& unit) {
    const std::string digest = Sha256Hex(unit.place);
    return static_cast<int>(std::stoull(digest.substr(0, 15), nullptr, 16) %
                            static_cast<std::uint64_t>(count)) != index;
  });
  return units;
}

}  // namespace truetriad::fleet
