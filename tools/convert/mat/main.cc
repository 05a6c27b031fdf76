// SPDX-License-Identifier: Apache-2.0
//
// MATLAB files (.mat) to a recording. docs/converting.md.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/isolation.h"
#include "tools/convert/common/recording_folder.h"
#include "tools/convert/mat/mat_variables.h"
#include "truetriad/base/units.h"

namespace truetriad::convert {
namespace {

constexpr std::array<std::string_view, 5> kRoles = {
    "time", "accelerometer", "gyroscope", "magnetometer", "temperature"};

/// Names, in lower case, that can only mean one thing.
const std::map<std::string, std::string, std::less<>>& KnownNames() {
  static const auto& names =
      *new std::map<std::string, std::string, std::less<>>{{"t", "time"},
                                                           {"time", "time"},
                                                           {"timestamp", "time"},
                                                           {"acc", "accelerometer"},
                                                           {"accel", "accelerometer"},
                                                           {"accelerometer", "accelerometer"},
                                                           {"acceleration", "accelerometer"},
                                                           {"gyr", "gyroscope"},
                                                           {"gyro", "gyroscope"},
                                                           {"gyroscope", "gyroscope"},
                                                           {"angularvelocity", "gyroscope"},
                                                           {"mag", "magnetometer"},
                                                           {"magnetometer", "magnetometer"},
                                                           {"magneticfield", "magnetometer"},
                                                           {"temp", "temperature"},
                                                           {"temperature", "temperature"}};
  return names;
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

std::string Shape(const MatVariable& variable) {
  return std::to_string(variable.rows) + "x" + std::to_string(variable.columns);
}

std::string Describe(const MatVariable& variable) {
  return Printable(variable.name) + " (" + Shape(variable) + " " + variable.class_name + ")";
}

std::vector<std::string> AllVariables(const MatFile& file) {
  std::vector<std::string> names;
  for (const MatVariable& variable : file.variables()) names.push_back(Describe(variable));
  return names;
}

/// What each role is called in the file: as the user says, else by names that are clear.
Result<std::map<std::string, std::string>> ChooseColumns(const MatFile& file,
                                                         const Arguments& arguments) {
  std::map<std::string, std::string> chosen;
  const auto stated = arguments.others.find("columns");
  if (stated != arguments.others.end()) {
    for (const std::string& item : Split(stated->second, ',')) {
      const std::size_t equals = item.find('=');
      const std::string role = item.substr(0, equals);
      if (equals == std::string::npos ||
          std::find(kRoles.begin(), kRoles.end(), role) == kRoles.end()) {
        return Error(ErrorCode::kInvalidArgument,
                     "--columns: `" + item +
                         "` is not one of time=, accelerometer=, gyroscope=, magnetometer=, "
                         "temperature=");
      }
      if (!chosen.emplace(role, item.substr(equals + 1)).second) {
        return Error(ErrorCode::kInvalidArgument, "--columns: " + role + " is given twice");
      }
    }
    return chosen;
  }
  std::map<std::string, std::vector<std::string>> candidates;
  for (const MatVariable& variable : file.variables()) {
    std::string name = variable.name.substr(variable.name.rfind('.') + 1);
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
      return static_cast<char>(std::tolower(c));
    });
    const auto known = KnownNames().find(name);
    if (known != KnownNames().end()) candidates[known->second].push_back(variable.name);
  }
  for (const auto& [role, names] : candidates) {
    if (names.size() > 1) {
      return Error(ErrorCode::kMissingArgument,
                   std::string("several variables match the ")
                       .append(role)
                       .append(": ")
                       .append(ListOf(names))
                       .append("; choose one with --columns"));
    }
    chosen[role] = names[0];
    Note(std::string(role).append(": taken from ").append(Printable(names[0])));
  }
  return chosen;
}

/// Units by role; `counts` for every triad that has no other.
Result<std::map<std::string, std::string>> ReadUnits(
    const std::map<std::string, std::string>& columns, const Arguments& arguments) {
  std::map<std::string, std::string> units;
  const auto stated = arguments.others.find("units");
  bool counts = false;
  for (const std::string& unit :
       Split(stated == arguments.others.end() ? "" : stated->second, ',')) {
    bool known = unit == "counts";
    counts = counts || known;
    for (const Triad triad : kTriads) {
      if (unit != "counts" && ParseTriadUnit(triad, unit)) {
        units[std::string(TriadName(triad))] = unit;
        known = true;
      }
    }
    if (NanosecondsPer(unit)) {
      units["time"] = unit;
      known = true;
    }
    if (ParseTemperatureUnit(unit)) {
      units["temperature"] = unit;
      known = true;
    }
    if (!known)
      return Error(ErrorCode::kInvalidArgument, "--units: `" + unit + "` is not a known unit");
  }
  for (const auto& [role, column] : columns) {
    if (units.contains(role) || (role == "time" && column.ends_with("Hz"))) continue;
    if (TriadFromName(role) && counts) {
      units[role] = "counts";
    } else {
      return Error(ErrorCode::kMissingArgument,
                   "the unit of the " + role +
                       " is missing, and a .mat file does not contain units; state them, as in "
                       "--units=s,m/s^2,rad/s,uT,degC");
    }
  }
  return units;
}

/// A column reference: a variable, some of its columns (data:2-4, from 1 on as in MATLAB), or three
/// variables (ax+ay+az). Its vectors, each as long as the first.
Result<std::vector<std::vector<double>>> ReadVectors(MatFile* file,
                                                     const std::string& reference,
                                                     std::size_t expected) {
  std::vector<std::vector<double>> vectors;
  for (const std::string& part : Split(reference, '+')) {
    const std::size_t colon = part.find(':');
    const MatVariable* const variable = file->Find(part.substr(0, colon));
    if (variable == nullptr && file->is_damaged()) {
      return Error(ErrorCode::kDamagedFile,
                   "the file is damaged, and variable " + part.substr(0, colon) +
                       " is missing or incomplete");
    }
    if (variable == nullptr) {
      return Error(ErrorCode::kUnknownName,
                   "no numeric variable `" + part.substr(0, colon) + "`; the file contains " +
                       ListOf(AllVariables(*file), 30));
    }
    Result<MatMatrix> matrix = file->Read(*variable);
    TRUETRIAD_RETURN_IF_ERROR(matrix);
    std::size_t first = 1;
    std::size_t last = 0;
    if (colon != std::string::npos) {
      const std::string range = part.substr(colon + 1);
      const char* const end = range.data() + range.size();
      auto parsed = std::from_chars(range.data(), end, first);
      last = first;
      if (parsed.ec == std::errc() && parsed.ptr != end && *parsed.ptr == '-') {
        parsed = std::from_chars(parsed.ptr + 1, end, last);
      }
      if (parsed.ec != std::errc() || parsed.ptr != end || first < 1 || last < first ||
          last > matrix->columns) {
        return Error(ErrorCode::kInvalidArgument,
                     "`" + part + "`: expected column numbers from 1 to " +
                         std::to_string(matrix->columns) + ", as in data:2-4");
      }
    } else {
      // Samples lie along the longer side.
      const bool is_turned = matrix->columns > matrix->rows;
      if (is_turned) {
        MatMatrix turned{.rows = matrix->columns, .columns = matrix->rows, .values = {}};
        for (std::size_t column = 0; column < turned.columns; ++column) {
          for (std::size_t row = 0; row < turned.rows; ++row) {
            turned.values.push_back(matrix->At(column, row));
          }
        }
        *matrix = std::move(turned);
      }
      last = matrix->columns;
    }
    for (std::size_t column = first; column <= last; ++column) {
      const auto begin =
          matrix->values.begin() + static_cast<std::ptrdiff_t>((column - 1) * matrix->rows);
      vectors.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(matrix->rows));
    }
  }
  if (vectors.size() != expected) {
    return Error(ErrorCode::kInvalidArgument,
                 "`" + reference + "` has " + std::to_string(vectors.size()) +
                     " columns; expected " + std::to_string(expected));
  }
  return vectors;
}

/// The times of `count` samples in ns.
Result<std::vector<std::int64_t>> ReadTimes(MatFile* file,
                                            const std::string& reference,
                                            const std::string& unit,
                                            std::size_t count) {
  std::vector<std::int64_t> times;
  if (reference.ends_with("Hz")) {
    double rate_hz = 0.0;
    std::from_chars(reference.data(), reference.data() + reference.size() - 2, rate_hz);
    if (!(rate_hz > 0.0 && rate_hz < 1e9)) {
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: time=" + reference + ": expected a rate, as in time=100Hz");
    }
    for (std::size_t i = 0; i < count; ++i) {
      times.push_back(std::llround(static_cast<double>(i) * 1e9 / rate_hz));
    }
    return times;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::vector<double>> vectors,
                             ReadVectors(file, reference, 1));
  const double ns = *NanosecondsPer(unit);
  constexpr double kLast = 9.2e18;
  for (const double value : vectors[0]) {
    const double time_ns = value * ns;
    if (!(std::abs(time_ns) < kLast)) {
      return Error(ErrorCode::kUnreadableNumber,
                   {reference},
                   "contains a time that is not a number or not a valid date");
    }
    times.push_back(std::llround(time_ns));
  }
  return times;
}

Status Convert(MatFile* file,
               const std::map<std::string, std::string>& columns,
               const std::map<std::string, std::string>& units,
               RecordingFolder* folder) {
  const auto time = columns.find("time");
  std::vector<double> temperature;
  if (const auto stated = columns.find("temperature"); stated != columns.end()) {
    const Result<std::vector<std::vector<double>>> vectors = ReadVectors(file, stated->second, 1);
    if (!vectors && vectors.error().kind() == ErrorKind::kUsage) return vectors.error();
    if (!vectors) Note(vectors.error().message + "; converted without temperature");
    if (vectors) temperature = (*vectors)[0];
    const TemperatureUnit unit = *ParseTemperatureUnit(units.at("temperature"));
    for (double& value : temperature) value = unit.scale * value + unit.offset;
  }
  std::size_t damaged = 0;
  for (const Triad triad : kTriads) {
    const auto stated = columns.find(std::string(TriadName(triad)));
    if (stated == columns.end()) continue;
    const Result<std::vector<std::vector<double>>> axes = ReadVectors(file, stated->second, 3);
    if (!axes && axes.error().kind() == ErrorKind::kBadInput) {
      Note(axes.error().message + "; sensor skipped");
      ++damaged;
      continue;
    }
    TRUETRIAD_RETURN_IF_ERROR(axes);
    const std::size_t count = (*axes)[0].size();
    TRUETRIAD_ASSIGN_OR_RETURN(
        const std::vector<std::int64_t> times,
        ReadTimes(file, time->second, time->second.ends_with("Hz") ? "" : units.at("time"), count));
    for (const std::vector<double>& axis : *axes) {
      if (axis.size() == times.size()) continue;
      return Error(ErrorCode::kDoesNotMatch,
                   {stated->second},
                   "has " + std::to_string(axis.size()) + " samples, but the time has " +
                       std::to_string(times.size()));
    }
    const bool has_temperature = temperature.size() == count;
    Table* const table =
        folder->AddTable(std::string(TriadName(triad)) + ".csv",
                         {{.triad = triad, .unit = units.at(stated->first), .applied = {}}},
                         has_temperature);
    for (std::size_t i = 0; i < count; ++i) {
      if (has_temperature) table->SetTemperature(temperature[i]);
      const std::array<double, 3> reading = {(*axes)[0][i], (*axes)[1][i], (*axes)[2][i]};
      table->Add(times[i], reading.data());
    }
  }
  if (damaged > 0) folder->SetSource("incomplete variables", std::to_string(damaged));
  return folder->Commit();
}

Status ReadFile(const Arguments& arguments, RecordingFolder* folder) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<MatFile> file, MatFile::Open(arguments.input));
  if (arguments.list) {
    for (const MatVariable& variable : file->variables()) {
      std::printf("%-32s %12s  %s\n",
                  Printable(variable.name).c_str(),
                  Shape(variable).c_str(),
                  variable.class_name.c_str());
    }
    return {};
  }
  if (file->is_damaged()) {
    Note(arguments.input + ": is damaged: a variable is incomplete, and later ones may be missing");
  }
  if (file->variables().empty()) {
    return Error(ErrorCode::kNoReadings, {arguments.input}, "contains no complete numeric matrix");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto columns, ChooseColumns(*file, arguments));
  const bool has_triad = std::any_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
    return columns.contains(std::string(TriadName(triad)));
  });
  if (!has_triad || !columns.contains("time")) {
    return Error(
        ErrorCode::kMissingArgument,
        "cannot tell from the names which variables are the " +
            std::string(has_triad ? "time" : "readings") +
            "; state them, as in --columns=time=t,accelerometer=imu.acc,gyroscope=gx+gy+gz (or "
            "time=100Hz). The file contains " +
            ListOf(AllVariables(*file), 30));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto units, ReadUnits(columns, arguments));
  folder->SetSource("format", "matlab");
  folder->SetSource("file", std::filesystem::path(arguments.input).filename().string());
  folder->SetSource("converter", "truetriad-convert-mat " TRUETRIAD_VERSION);
  for (const auto& [role, column] : columns) folder->SetSource(role, column);
  return Convert(file.get(), columns, units, folder);
}

Status Run(const Arguments& arguments) {
  std::unique_ptr<RecordingFolder> folder;
  if (!arguments.list) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<RecordingFolder> created,
                               RecordingFolder::Create(arguments.output));
    folder = std::move(created);
  }
  // A damaged file can bring the library down, which must not leave half a recording behind.
  return Isolated(arguments.input, [&] { return ReadFile(arguments, folder.get()); });
}

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  const truetriad::convert::Converter converter = {
      .format = "mat",
      .input = "a MATLAB file (.mat of version 5, 7 or 7.3)",
      .details =
          "\n--columns=time=t,accelerometer=imu.acc,gyroscope=gx+gy+gz,magnetometer=data:5-7 maps "
          "the\nsensors to a variable, a struct field, three of either, or a range of columns "
          "(from 1);\nuse time=100Hz if there is no time. By default names such as acc, gyro, mag, "
          "t and temp\nare recognised if each occurs once. --units=s,m/s^2,rad/s,uT,degC states "
          "the units, which\na .mat file does not contain. Readings are assumed to be raw.\n",
      .takes_topics = false,
      .takes_instance = false,
      .others = {"columns", "units"},
      .run = truetriad::convert::Run};
  return truetriad::convert::RunConverter(converter, argc, argv);
}
