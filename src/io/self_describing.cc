// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "io/recording_layout.h"

namespace truetriad {
namespace {

/// The unit that messages about a missing unit give as an example.
std::string_view ExampleUnit(Triad triad) { return TruthUnitName(triad); }

/// How columns of a quantity are usually called: the beginning of the name (acc_x), a letter that
/// may replace this beginning before an axis (ax), and this program's name (accel).
struct Calling {
  std::string_view beginning, letter, name;
};
constexpr std::array<Calling, 6> kCallings = {{{"acc", "a", "accel"},
                                               {"gyr", "g", "gyro"},
                                               {"omega", "w", "gyro"},
                                               {"mag", "m", "mag"},
                                               {"temp", "", "temperature"},
                                               {"time", "", "time"}}};

/// Usual last words of a column's name that indicate a unit.
struct UnitWord {
  std::string_view word, unit;
  bool is_time;
};
constexpr std::array<UnitWord, 28> kUnitWords = {
    {{"s", "s", true},          {"sec", "s", true},          {"secs", "s", true},
     {"seconds", "s", true},    {"ms", "ms", true},          {"msec", "ms", true},
     {"millis", "ms", true},    {"us", "us", true},          {"usec", "us", true},
     {"micros", "us", true},    {"ns", "ns", true},          {"nsec", "ns", true},
     {"nanos", "ns", true},     {"g", "g", false},           {"mg", "mg", false},
     {"mps2", "m/s^2", false},  {"ms2", "m/s^2", false},     {"dps", "deg/s", false},
     {"degs", "deg/s", false},  {"degps", "deg/s", false},   {"rads", "rad/s", false},
     {"radps", "rad/s", false}, {"ut", "uT", false},         {"gauss", "gauss", false},
     {"raw", "counts", false},  {"counts", "counts", false}, {"lsb", "counts", false},
     {"adc", "counts", false}}};

/// The letters and digits of a column's name, and the unit that its last word indicates.
struct SeemingName {
  std::string letters;
  const UnitWord* unit = nullptr;
};

SeemingName TakenApart(const std::string& column) {
  SeemingName name;
  std::string word;
  std::string text = LowerCase(column);
  using Spelling = std::pair<std::string_view, std::string_view>;
  for (const auto& [per, letters] :
       {Spelling("/s^2", "ps2"), Spelling("/s2", "ps2"), Spelling("/s", "ps")}) {
    if (const auto at = text.rfind(per); at != std::string::npos) {
      text.replace(at, per.size(), letters);
    }
  }
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
    } else {
      name.letters += std::exchange(word, {});
    }
  }
  const auto unit = std::find_if(kUnitWords.begin(), kUnitWords.end(), [&](const UnitWord& known) {
    return known.word == word;
  });
  if (unit != kUnitWords.end()) name.unit = &*unit;
  if (name.unit == nullptr || name.letters.empty()) name.letters += word;
  return name;
}

}  // namespace

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return text;
}

std::string SeeminglyCalled(const std::string& column) {
  const auto [letters, unit] = TakenApart(column);
  if (letters == "t" || letters == "ts" || letters == "stamp") return "time";
  // If the name consists only of a unit of time, such as "ms" or "micros", the column is the time.
  if (unit != nullptr && unit->is_time && letters == unit->word && letters.size() > 1)
    return "time";
  const char last = letters.empty() ? ' ' : letters.back();
  const bool has_axis = last >= 'x' && last <= 'z';
  for (const auto& [beginning, letter, name] : kCallings) {
    const bool has_axes = name != "time" && name != "temperature";
    const bool is_letter =
        has_axes && has_axis && letters.size() == 2 && letters.front() == letter[0];
    if (!letters.starts_with(beginning) && !is_letter) continue;
    std::string called(name);
    if (has_axes) called += has_axis ? std::string("_") + last : "_";
    return called;
  }
  return {};
}

std::string SeeminglyIn(const std::string& column) {
  const SeemingName name = TakenApart(column);
  const std::string called = SeeminglyCalled(column);
  const bool is_time = called == "time";
  const std::string_view unit = name.unit != nullptr ? name.unit->unit : "";
  if (called.starts_with("mag") && (unit == "g" || unit == "mg")) return unit == "g" ? "G" : "mG";
  return name.unit != nullptr && name.unit->is_time == is_time ? std::string(name.unit->unit) : "";
}

HeaderColumn ParseHeaderColumn(const std::string& field) {
  const bool is_round = !field.empty() && field.back() == ')';
  const std::size_t open = field.find(is_round ? '(' : '[');
  if (open == std::string::npos || (!is_round && field.back() != ']')) return {field, ""};
  const std::size_t name_end = field.find_last_not_of(" \t", open == 0 ? 0 : open - 1) + 1;
  return {field.substr(0, std::min(open, name_end)),
          field.substr(open + 1, field.size() - open - 2)};
}

std::optional<int> TimePower(std::string_view unit) {
  const std::optional<double> nanoseconds = NanosecondsPer(unit);
  if (!nanoseconds) return std::nullopt;
  return static_cast<int>(std::lround(std::log10(*nanoseconds)));
}

Result<HeaderColumns> HeaderColumns::Of(const CsvReader& csv) {
  HeaderColumns header;
  header.place_ = {csv.path(), csv.header_line()};
  header.may_number_rows_ = csv.may_begin_with_row_numbers();
  if (csv.header().empty()) {
    return Error(ErrorCode::kNoHeader,
                 {csv.path()},
                 "has no header; name the columns with their units in the first line, like "
                 "`time[s],accel_x[m/s^2],…`, or map them in a manifest recording.yaml");
  }
  const std::size_t named = csv.header().size() - csv.empty_at_end();
  for (const std::string& field : csv.header()) {
    HeaderColumn column = ParseHeaderColumn(field);
    if (header.columns_.size() >= named) {
      header.columns_.push_back(std::move(column));
      continue;
    }
    for (const HeaderColumn& other : header.columns_) {
      if (LowerCase(other.name) == LowerCase(column.name)) {
        FilePlace place = header.place_;
        place.column = static_cast<int>(header.columns_.size()) + 1;
        if (column.name.empty()) {
          return Error(ErrorCode::kDuplicateColumn,
                       std::move(place),
                       "has several columns without a name; name them, or map columns in a "
                       "manifest recording.yaml");
        }
        return Error(ErrorCode::kDuplicateColumn,
                     std::move(place),
                     "column `" + column.name +
                         (other.name == column.name
                              ? "` occurs twice"
                              : "` also occurs as `" + other.name +
                                    "`, and names must differ in more than upper and lower case") +
                         "; rename one of them");
      }
    }
    header.columns_.push_back(std::move(column));
  }
  header.taken_.resize(header.columns_.size());
  return header;
}

std::optional<std::size_t> HeaderColumns::Take(const std::string& name) {
  asked_.push_back(name);
  for (std::size_t column = 0; column < columns_.size(); ++column) {
    if (LowerCase(columns_[column].name) == LowerCase(name)) {
      taken_[column] = true;
      return column;
    }
  }
  return std::nullopt;
}

Error HeaderColumns::Fail(ErrorCode code, std::size_t column, const std::string& message) const {
  FilePlace place = place_;
  place.column = static_cast<int>(column) + 1;
  return Error(code, std::move(place), "column `" + columns_[column].name + "`: " + message);
}

Result<std::string> HeaderColumns::UnitOf(std::size_t column, std::string_view example) const {
  const HeaderColumn& stated = columns_[column];
  if (stated.unit.empty()) {
    return Fail(ErrorCode::kMissingUnit,
                column,
                "has no unit; state it in the header, like `" + stated.name + "[" +
                    std::string(example) + "]`" +
                    (example == "s" ? "; times must be numbers: convert dates" : ""));
  }
  return stated.unit;
}

Result<std::string> HeaderColumns::CommonUnitOf(const std::vector<std::size_t>& columns,
                                                std::string_view example) const {
  Result<std::string> common = UnitOf(columns.front(), example);
  for (const std::size_t column : columns) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string unit, UnitOf(column, example));
    if (unit != *common) {
      return Fail(ErrorCode::kUnitMismatch,
                  column,
                  "is in " + unit + ", but `" + columns_[columns.front()].name + "` is in " +
                      *common + "; use one unit for all axes of a sensor");
    }
  }
  return common;
}

Result<std::optional<HeaderColumns::Axes>> HeaderColumns::TakeAxes(Triad triad,
                                                                   const std::string& prefix) {
  std::vector<std::size_t> found;
  std::string missing;
  for (const char* axis : {"_x", "_y", "_z"}) {
    if (const std::optional<std::size_t> column = Take(prefix + axis)) {
      found.push_back(*column);
    } else {
      missing = prefix + axis;
    }
  }
  if (found.empty()) return std::optional<Axes>();
  if (!missing.empty()) {
    std::string seems;
    for (std::size_t column = 0; column < columns_.size(); ++column) {
      if (taken_[column] || SeeminglyCalled(columns_[column].name) != missing) continue;
      seems = "; `" + columns_[column].name + "` seems to be this column: rename it";
    }
    return Fail(ErrorCode::kMissingColumn,
                found.front(),
                "has no matching `" + missing + "`; all three axes are needed" + seems);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string name, CommonUnitOf(found, ExampleUnit(triad)));
  const Result<Unit> unit = ParseTriadUnit(triad, name);
  if (!unit) return Fail(unit.error().code, found.front(), unit.error().message);
  return std::optional<Axes>({{found[0], found[1], found[2]}, *unit});
}

bool HeaderColumns::HasTaken(std::string_view name) const {
  for (std::size_t column = 0; column < columns_.size(); ++column) {
    if (LowerCase(columns_[column].name) == name) return taken_[column];
  }
  return false;
}

bool HeaderColumns::MayBeNeeded(const HeaderColumn& column) const {
  std::string called = SeeminglyCalled(column.name);
  if (called.ends_with('_')) called += 'x';
  if (!called.empty() && !HasTaken(called)) return true;
  for (const Triad triad : kTriads) {
    const bool is_reading = !column.unit.empty() && ParseTriadUnit(triad, column.unit);
    if (is_reading && !HasTaken(std::string(TriadPrefix(triad)) + "_x")) return true;
  }
  return TimePower(column.unit) && !HasTaken("time");
}

std::string HeaderColumns::Understandable() const {
  std::string header;
  std::vector<std::string> names;
  for (std::size_t column = 0; column < columns_.size(); ++column) {
    const auto& [name, unit] = columns_[column];
    std::string called = taken_[column] ? LowerCase(name) : SeeminglyCalled(name);
    const bool is_found = !called.empty() && !called.ends_with('_') &&
                          std::find(names.begin(), names.end(), called) == names.end();
    if (!is_found && !taken_[column] && MayBeNeeded(columns_[column])) return {};
    names.push_back(called);
    if (!is_found) called = name;
    std::string stated = unit.empty() && is_found ? SeeminglyIn(name) : unit;
    for (const Triad triad : kTriads) {
      const bool is_its = called.starts_with(std::string(TriadPrefix(triad)) + "_");
      if (stated.empty() && is_found && is_its) stated = TruthUnitName(triad);
    }
    if (stated.empty() && called == "time") stated = "s";
    if (stated.empty() && called == "temperature") stated = "degC";
    header += (column == 0 ? "" : ",") + called + (stated.empty() ? "" : "[" + stated + "]");
  }
  // The header must have the three axes of a sensor.
  const auto has = [&names](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const bool has_sensor = std::any_of(kTriads.begin(), kTriads.end(), [&has](const Triad triad) {
    const std::string prefix(TriadPrefix(triad));
    return has(prefix + "_x") && has(prefix + "_y") && has(prefix + "_z");
  });
  return has_sensor ? header : "";
}

Result<std::vector<std::string>> HeaderColumns::Ignored() const {
  std::vector<std::string> ignored, unknown;
  for (std::size_t column = 0; column < columns_.size(); ++column) {
    if (taken_[column]) continue;
    const std::string& name = columns_[column].name;
    if (column == 0 && name.empty()) {
      // Tables of pandas begin with an unnamed column of row numbers, but an unnamed column may
      // also be the time.
      if (!may_number_rows_ && !HasTaken("time")) {
        return Error(ErrorCode::kUnknownColumn,
                     place_,
                     "the first column has no name and does not hold row numbers; name it, like "
                     "`time[s]`, or remove it");
      }
      ignored.emplace_back(kUnnamedRowNumbers);
      continue;
    }
    (MayBeNeeded(columns_[column]) ? unknown : ignored).push_back(name);
  }
  if (unknown.empty()) return ignored;
  std::string text = unknown.size() == 1 ? "column " : "columns ";
  for (const std::string& name : unknown) {
    text += (&name == &unknown.front() ? "`" : ", `") + name + "`";
  }
  text += unknown.size() == 1 ? " is unknown; " : " are unknown; ";
  if (const std::string header = Understandable(); !header.empty()) {
    text += "a header like `" + header + "`, with your units, is understood";
  } else {
    std::string known;
    for (const std::string& name : asked_) known += (known.empty() ? "" : ", ") + name;
    text += "rename to " + known + " (each with its unit), or remove columns that are no readings";
  }
  return Error(
      ErrorCode::kUnknownColumn, place_, text + ", or map columns in a manifest recording.yaml");
}

std::string HeaderColumns::Names() const {
  // Chosen: a message with more or longer names would not be read.
  constexpr std::size_t kNamed = 40, kLongestName = 60;
  std::string names;
  for (std::size_t i = 0; i < std::min(columns_.size(), kNamed); ++i) {
    const std::string& name = columns_[i].name;
    names += (i == 0 ? "" : ", ") +
             (name.size() <= kLongestName ? name : std::to_string(name.size()) + " characters");
  }
  if (columns_.size() > kNamed)
    names += " and " + std::to_string(columns_.size() - kNamed) + " more";
  return names;
}

Error HeaderColumns::NoSensors() const {
  return Error(
      ErrorCode::kMissingColumn,
      {place_.file},
      "has no sensor columns; its columns are " + Names() +
          "; expected accel_x, accel_y, accel_z, or gyro_… or mag_…, each with its unit: rename "
          "them, or map them in a manifest recording.yaml");
}

Result<TimeColumn> TakeTime(HeaderColumns* header) {
  const std::optional<std::size_t> column = header->Take("time");
  if (!column) return TimeColumn{};
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string unit, header->UnitOf(*column, "s"));
  const std::optional<int> power = TimePower(unit);
  if (!power) {
    return header->Fail(ErrorCode::kUnknownUnit,
                        *column,
                        "`" + unit + "` is not a unit of time; expected s, ms, us or ns");
  }
  return TimeColumn{TimeColumn::Kind::kColumn, *column, *power, 1.0};
}

Result<std::optional<TemperatureColumn>> TakeTemperature(HeaderColumns* header,
                                                         const std::string& name) {
  const std::optional<std::size_t> column = header->Take(name);
  if (!column) return std::optional<TemperatureColumn>();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string stated, header->UnitOf(*column, "degC"));
  const std::optional<TemperatureUnit> unit = ParseTemperatureUnit(stated);
  if (!unit) {
    return header->Fail(ErrorCode::kUnknownUnit,
                        *column,
                        "`" + stated + "` is not a unit of temperature; expected degC or K");
  }
  return std::optional<TemperatureColumn>({*column, *unit});
}

Result<RecordingLayout> OpenSelfDescribing(const std::string& path,
                                           const std::string& pose_column) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<CsvReader> csv, CsvReader::OpenHead(path));
  TRUETRIAD_ASSIGN_OR_RETURN(HeaderColumns header, HeaderColumns::Of(*csv));

  StreamLayout common;
  TRUETRIAD_ASSIGN_OR_RETURN(const TimeColumn time, TakeTime(&header));
  common.time = time;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<TemperatureColumn> temperature,
                             TakeTemperature(&header));
  common.temperature = temperature;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<TemperatureColumn> ambient,
                             TakeTemperature(&header, "ambient_temperature"));
  common.ambient = ambient;
  const std::string pose = pose_column.empty() ? "pose" : pose_column;
  common.pose = header.Take(pose);
  if (!common.pose && !pose_column.empty()) {
    return Error(
        ErrorCode::kMissingColumn, {path}, "has no column `" + pose_column + "` with pose numbers");
  }
  common.info.file = path;
  common.info.has_temperature = common.temperature.has_value();
  common.info.has_ambient = common.ambient.has_value();
  common.info.has_pose_column = common.pose.has_value();

  RecordingLayout layout;
  layout.info.path = path;
  layout.info.has_time = common.time.kind != TimeColumn::Kind::kNone;
  FileLayout file;
  for (const Triad triad : kTriads) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<HeaderColumns::Axes> axes,
                               header.TakeAxes(triad, std::string(TriadPrefix(triad))));
    if (!axes) continue;
    StreamLayout stream = common;
    stream.info.triad = triad;
    stream.info.unit = axes->unit;
    stream.axes = axes->columns;
    layout.info.streams.push_back(stream.info);
    file.streams.push_back(std::move(stream));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(layout.info.ignored_columns, header.Ignored());
  if (file.streams.empty()) {
    return header.NoSensors();
  }
  file.csv = std::move(csv);
  layout.files.push_back(std::move(file));
  return layout;
}

}  // namespace truetriad
