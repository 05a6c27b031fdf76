// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_list.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <glob.h>

#include "base/spelling.h"
#include "fleet/log_files.h"
#include "io/text_file.h"
#include "io/yaml_text.h"
#include "truetriad/model/tags.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// The fields of a line of CSV, quotes taken off.
std::vector<std::string> FieldsOf(std::string_view line) {
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
  return fields;
}

/// A line without the carriage return of other systems, and without their mark in front.
bool NextLine(std::ifstream* file, std::string* line) {
  if (!std::getline(*file, *line)) return false;
  if (line->ends_with('\r')) line->pop_back();
  if (line->starts_with("\xEF\xBB\xBF")) line->erase(0, 3);
  return true;
}

std::string TagOverride(const std::string& key, const std::string& value) {
  const bool is_of_device = std::any_of(
      kDeviceTags.begin(), kDeviceTags.end(), [&](const TagKey& tag) { return tag.key == key; });
  YamlText text;
  text << (is_of_device ? "device." : "run.") << key << "=" << Quoted{value};
  return text.str();
}

/// The columns that a list may have.
std::vector<std::string_view> ListColumns() {
  std::vector<std::string_view> columns = {"log", "serial"};
  for (const TagKey& tag : kDeviceTags) columns.push_back(tag.key);
  for (const TagKey& tag : kRunTags) columns.push_back(tag.key);
  return columns;
}

/// Whether a CSV is a list of logs: it has a column that is called so.
bool IsList(const fs::path& path) {
  if (!path.filename().string().ends_with(".csv")) return false;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (NextLine(&file, &line) && (line.empty() || line.starts_with('#'))) {
  }
  const std::vector<std::string> header = FieldsOf(line);
  return std::find(header.begin(), header.end(), "log") != header.end();
}

Status AddList(const fs::path& path, std::vector<UnitOrder>* units) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::string> header;
  const std::vector<std::string_view> known = ListColumns();
  int number = 0;
  for (std::string line; NextLine(&file, &line);) {
    ++number;
    if (line.empty() || line.starts_with('#')) continue;
    const std::vector<std::string> fields = FieldsOf(line);
    if (header.empty()) {
      header = fields;
      for (const std::string& column : header) {
        if (std::find(known.begin(), known.end(), column) != known.end()) continue;
        return Error(ErrorCode::kUnknownColumn,
                     {path.string(), number},
                     "column `" + column + "` is unknown" + DidYouMean(column, known) +
                         "; a list has log, serial and tags");
      }
      continue;
    }
    if (fields.size() != header.size()) {
      return Error(ErrorCode::kWrongFieldCount,
                   {path.string(), number},
                   "has " + std::to_string(fields.size()) + " fields; expected " +
                       std::to_string(header.size()));
    }
    UnitOrder& unit = units->emplace_back();
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (header[i] == "log") {
        unit.log = (path.parent_path() / fields[i]).lexically_normal().string();
      } else if (header[i] == "serial") {
        unit.serial = fields[i];
      } else if (!fields[i].empty()) {
        unit.overrides.push_back(TagOverride(header[i], fields[i]));
      }
    }
  }
  return {};
}

Status AddFolder(const fs::path& folder, std::vector<UnitOrder>* units) {
  const std::size_t before = units->size();
  TRUETRIAD_RETURN_IF_ERROR(ForEachLog(
      folder,
      [](const fs::path&) { return true; },
      [&](const fs::path& log) { units->push_back({.log = log.string()}); }));
  if (units->size() == before) {
    return Error(ErrorCode::kNoReadings,
                 {folder.string()},
                 "has no log; expected *.csv, *.csv.gz, or folders with a recording.yaml");
  }
  return {};
}

Status AddWord(const std::string& word, std::vector<UnitOrder>* units) {
  std::error_code failure;
  if (fs::is_directory(word, failure)) {
    std::vector<UnitOrder> found;
    TRUETRIAD_RETURN_IF_ERROR(AddFolder(word, &found));
    std::sort(found.begin(), found.end(), [](const UnitOrder& a, const UnitOrder& b) {
      return a.log < b.log;
    });
    units->insert(units->end(), found.begin(), found.end());
    return {};
  }
  if (fs::exists(word, failure)) {
    if (IsList(word)) return AddList(word, units);
    units->push_back({.log = word});
    return {};
  }
  glob_t found{};
  const int code = glob(word.c_str(), 0, nullptr, &found);  // In the order of names.
  std::vector<std::string> names(found.gl_pathv, found.gl_pathv + (code == 0 ? found.gl_pathc : 0));
  globfree(&found);
  if (names.empty()) {
    return Error(ErrorCode::kUnreadableFile,
                 {word},
                 "there is no such log, list or folder, and no file has a name like it");
  }
  for (const std::string& name : names) TRUETRIAD_RETURN_IF_ERROR(AddWord(name, units));
  return {};
}

/// Whether `name` is `pattern` with anything for each `*`.
bool Matches(std::string_view name, std::string_view pattern) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return name == pattern;
  if (!name.starts_with(pattern.substr(0, star))) return false;
  for (std::size_t at = star; at <= name.size(); ++at) {
    if (Matches(name.substr(at), pattern.substr(star + 1))) return true;
  }
  return false;
}

/// What stands for {serial} in `name`, as short as it can be; unset: it does not match.
std::optional<std::string> SerialIn(std::string_view name, std::string_view pattern) {
  constexpr std::string_view kMark = "{serial}";
  const std::size_t mark = pattern.find(kMark);
  const std::string_view before = pattern.substr(0, mark),
                         after = pattern.substr(mark + kMark.size());
  for (std::size_t begin = 0; begin < name.size(); ++begin) {
    if (!Matches(name.substr(0, begin), before)) continue;
    for (std::size_t size = 1; begin + size <= name.size(); ++size) {
      if (Matches(name.substr(begin + size), after)) return std::string(name.substr(begin, size));
    }
  }
  return std::nullopt;
}

bool IsUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t size = lead < 0x80       ? 1
                             : lead >> 5 == 6  ? 2
                             : lead >> 4 == 14 ? 3
                             : lead >> 3 == 30 ? 4
                                               : 0;
    if (size == 0 || i + size > text.size()) return false;
    for (std::size_t k = 1; k < size; ++k) {
      if (static_cast<unsigned char>(text[i + k]) >> 6 != 2) return false;
    }
    i += size;
  }
  return true;
}

}  // namespace

Status CheckSerialPattern(const std::string& pattern) {
  if (pattern.empty() || pattern.find("{serial}") != std::string::npos) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--serial=" + pattern +
                   ": expected how files are named, with {serial} in it, as in {serial}-*.csv");
}

Status TakeSerial(const std::string& pattern, UnitOrder* unit) {
  if (!IsUtf8(unit->log)) {
    return Error(ErrorCode::kInvalidValue,
                 "a log's name is no UTF-8, and cannot be kept in a store; rename it");
  }
  if (pattern.empty() || !unit->serial.empty()) return {};
  fs::path path = unit->log;
  if (path.filename() == kManifestName) path = path.parent_path();
  const std::optional<std::string> serial = SerialIn(path.filename().string(), pattern);
  if (!serial) {
    return Error(ErrorCode::kDoesNotMatch, {unit->log}, "is not named like --serial=" + pattern);
  }
  unit->serial = *serial;
  return {};
}

Result<std::vector<UnitOrder>> ListUnits(const std::vector<std::string>& words,
                                         const std::string& serial_pattern) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSerialPattern(serial_pattern));
  std::vector<UnitOrder> units;
  for (const std::string& word : words) TRUETRIAD_RETURN_IF_ERROR(AddWord(word, &units));
  std::set<std::string> seen;
  for (UnitOrder& unit : units) {
    TRUETRIAD_RETURN_IF_ERROR(TakeSerial(serial_pattern, &unit));
    if (!seen.insert(fs::absolute(unit.log).lexically_normal().string()).second) {
      return Error(
          ErrorCode::kDuplicateKey, {unit.log}, "is there twice; name each log of a fleet once");
    }
  }
  return units;
}

std::vector<UnitOrder> ShardOf(std::vector<UnitOrder> units, int index, int count) {
  std::erase_if(units, [&](const UnitOrder& unit) {
    const std::string digest = Sha256Hex(unit.log);
    return static_cast<int>(std::stoull(digest.substr(0, 15), nullptr, 16) %
                            static_cast<std::uint64_t>(count)) != index;
  });
  return units;
}

}  // namespace truetriad::fleet
