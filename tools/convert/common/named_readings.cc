// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/common/named_readings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "io/recording_layout.h"
#include "tools/convert/common/recording_folder.h"
#include "truetriad/base/triad.h"

namespace truetriad::convert {
namespace {

constexpr std::array<std::string_view, 5> kRoles = {
    "time", "accelerometer", "gyroscope", "magnetometer", "temperature"};

/// The role that a name in lower case shows; empty if the name does not clearly show one.
std::string_view RoleOf(std::string_view name) {
  static const std::vector<std::vector<std::string_view>> known = {
      {"time", "t", "timestamp"},
      {"accelerometer", "acc", "accel", "acceleration"},
      {"gyroscope", "gyr", "gyro", "angularvelocity"},
      {"magnetometer", "mag", "magneticfield"},
      {"temperature", "temp"}};
  for (const auto& names : known) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return names[0];
  }
  return "";
}

std::string Shape(const Variable& variable) {
  return std::to_string(variable.rows) + "x" + std::to_string(variable.columns);
}

/// `time=none`: each row is one reading of a unit at rest.
constexpr std::string_view kNoTime = "none";

/// The contents of the input files.
struct Inputs {
  std::vector<std::string> paths;
  std::vector<Variable> variables;
  std::map<std::string, std::string> others;  ///< VariableFile::others of all files.
  bool is_damaged = false;

  /// All variables, for messages: "acc (200x3 double), …".
  std::string All() const {
    std::vector<std::string> all;
    for (const Variable& variable : variables) {
      all.push_back(PrintableLine(variable.full_name) + " (" + Shape(variable) + " " +
                    variable.type + ")");
    }
    return ListOf(all, 30);
  }

  /// Finds a variable by name, or by file and name. If several have the name, takes the one in the
  /// file `preferred`. Error (usage): there is none, or several. Error (bad input): a file is
  /// damaged and may lack the variable, or has it twice.
  Result<const Variable*> Find(const std::string& name, const std::string& preferred) const {
    std::vector<const Variable*> found;
    for (const Variable& variable : variables) {
      if (variable.name != name && variable.full_name != name) continue;
      if (variable.path == preferred) return &variable;
      found.push_back(&variable);
    }
    if (found.size() == 1) return found[0];
    if (found.size() > 1) {
      if (found[0]->full_name == found[1]->full_name) {
        return Error(ErrorCode::kDoesNotMatch,
                     {found[1]->path},
                     "variable `" + name +
                         "` occurs twice; give each file once, and each "
                         "variable a name of its own");
      }
      return Error(ErrorCode::kMissingArgument,
                   "several files have a variable `" + name +
                       "`; name the file, too: " + found[0]->full_name);
    }
    if (is_damaged) {
      return Error(
          ErrorCode::kDamagedFile,
          "the file cannot be read to its end, and variable " + name + " is missing or incomplete");
    }
    if (const auto other = others.find(name); other != others.end()) {
      return Error(ErrorCode::kUnknownName,
                   "variable `" + name + "` is " + other->second +
                       "; expected real numbers in rows and columns");
    }
    return Error(ErrorCode::kUnknownName, "no numeric variable `" + name + "`; there are " + All());
  }
};

/// "acc@t_acc": readings with their own time; the time is empty if `time=` applies.
struct TimedReference {
  std::string readings;
  std::string time;
};
TimedReference SplitTime(const std::string& reference) {
  const std::size_t at = reference.rfind('@');
  if (at == std::string::npos || at == 0 || at + 1 == reference.size()) return {reference, ""};
  return {reference.substr(0, at), reference.substr(at + 1)};
}

bool IsRate(const std::string& time) { return time.ends_with("Hz"); }

/// Whether every triad has a time. Error (usage): with `time=none` a triad has its own time.
Result<bool> HaveTimes(const ByRole& columns) {
  const auto common = columns.find("time");
  bool all = true;
  for (const Triad triad : kTriads) {
    const auto stated = columns.find(std::string(TriadName(triad)));
    if (stated == columns.end()) continue;
    const std::string own = SplitTime(stated->second).time;
    if (!own.empty() && common != columns.end() && common->second == kNoTime) {
      return Error(ErrorCode::kConflictingArguments,
                   "--columns: time=none, but the " + stated->first + " has the time `" + own +
                       "`; leave out one of them");
    }
    all = all && (!own.empty() || common != columns.end());
  }
  return all;
}

/// The variable of each role: the one that --columns states, or else one whose name shows the role.
Result<ByRole> ChooseColumns(const Inputs& inputs, const Arguments& arguments) {
  ByRole chosen;
  const auto stated = arguments.others.find("columns");
  if (stated != arguments.others.end()) return ParseColumns(stated->second, kRoles, "");
  std::map<std::string, std::set<std::string>> candidates;
  for (const Variable& variable : inputs.variables) {
    const std::string name = LowerCase(variable.name.substr(variable.name.rfind('.') + 1));
    const std::string role(RoleOf(name));
    if (role.empty()) continue;
    // If several files have a time or temperature, each belongs to the readings in the same file.
    const bool goes_along = role == "time" || role == "temperature";
    candidates[role].insert(goes_along ? variable.name : variable.full_name);
  }
  for (const auto& [role, names] : candidates) {
    if (names.size() > 1) {
      return Error(ErrorCode::kMissingArgument,
                   std::string("several variables match the ")
                       .append(role)
                       .append(": ")
                       .append(ListOf({names.begin(), names.end()}))
                       .append("; choose one with --columns"));
    }
    chosen[role] = *names.begin();
    Note(std::string(role).append(": taken from ").append(PrintableLine(*names.begin())));
  }
  return chosen;
}

/// Sets the unit of a role. Error (usage): the role already has another unit.
Status TakeUnit(const std::string& role, const std::string& unit, ByRole* units) {
  const auto [there, is_new] = units->emplace(role, unit);
  if (is_new || there->second == unit) return {};
  return Error(ErrorCode::kConflictingArguments,
               "--units: `" + there->second + "` and `" + unit + "` are both units of the " + role +
                   "; give one");
}

}  // namespace

Result<ByRole> ParseColumns(const std::string& columns,
                            std::span<const std::string_view> roles,
                            const std::string& example) {
  ByRole chosen;
  for (const std::string& item : Split(columns, ',')) {
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string role = item.substr(0, equals);
    if (equals == item.size() || std::find(roles.begin(), roles.end(), role) == roles.end()) {
      std::string all;
      for (const std::string_view known : roles)
        all.append(all.empty() ? "" : ", ").append(known) += '=';
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: `" + PrintableLine(item) + "` is not one of " + all + example);
    }
    if (!chosen.emplace(role, item.substr(equals + 1)).second)
      return Error(ErrorCode::kInvalidArgument, "--columns: " + role + " is given twice");
  }
  return chosen;
}

Result<ByRole> ReadUnits(const ByRole& columns, const Arguments& arguments) {
  ByRole units;
  const auto stated = arguments.others.find("units");
  bool counts = false;
  for (const std::string& unit :
       Split(stated == arguments.others.end() ? "" : stated->second, ',')) {
    bool known = unit == "counts";
    counts = counts || known;
    for (const Triad triad : kTriads) {
      if (unit != "counts" && ParseTriadUnit(triad, unit)) {
        TRUETRIAD_RETURN_IF_ERROR(TakeUnit(std::string(TriadName(triad)), unit, &units));
        known = true;
      }
    }
    if (NanosecondsPer(unit)) {
      TRUETRIAD_RETURN_IF_ERROR(TakeUnit("time", unit, &units));
      known = true;
    }
    if (ParseTemperatureUnit(unit)) {
      TRUETRIAD_RETURN_IF_ERROR(TakeUnit("temperature", unit, &units));
      known = true;
    }
    if (!known)
      return Error(ErrorCode::kInvalidArgument, "--units: `" + unit + "` is not a known unit");
  }
  ByRole needed = columns;
  for (const auto& [role, column] : columns) {
    const std::string own = TriadFromName(role) ? SplitTime(column).time : "";
    // A triad's own time needs a unit, as the common time does, unless it is a rate.
    if (!own.empty() && !IsRate(own)) needed["time"] = own;
  }
  for (const auto& [role, column] : needed) {
    if (units.contains(role) || (role == "time" && (IsRate(column) || column == kNoTime))) {
      continue;
    }
    if (TriadFromName(role) && counts) {
      units[role] = "counts";
    } else {
      return Error(ErrorCode::kMissingArgument,
                   "the unit of the " + role +
                       " is missing, and the file does not contain units; state them, as in "
                       "--units=s,m/s^2,rad/s,uT,degC");
    }
  }
  return units;
}

namespace {

/// The columns that a reference names: a variable, some of its columns (data:2-4, counted from 1),
/// three variables (ax+ay+az), or an interleaved list of x, y and z (data:xyz). `path`: the first
/// variable's file.
struct Vectors {
  std::vector<std::vector<double>> columns;
  std::string path;
};

Matrix Transposed(const Matrix& matrix) {
  Matrix turned{.rows = matrix.columns, .columns = matrix.rows, .values = {}};
  for (std::size_t column = 0; column < turned.columns; ++column) {
    for (std::size_t row = 0; row < turned.rows; ++row) {
      turned.values.push_back(matrix.At(column, row));
    }
  }
  return turned;
}

/// Turns a matrix so that each row is a sample of `width` columns. If neither side is `width`, the
/// longer side becomes the rows.
Matrix Upright(Matrix matrix, std::size_t width) {
  const bool is_upright =
      matrix.columns == width || (matrix.rows != width && matrix.columns <= matrix.rows);
  return is_upright ? std::move(matrix) : Transposed(matrix);
}

/// Splits an interleaved list of readings into three columns. Surplus values at the end must be NaN
/// (padding). Error (usage): a surplus value is a number.
Result<Matrix> InTurn(Matrix list, const std::string& part) {
  for (std::size_t i = list.values.size() / 3 * 3; i < list.values.size(); ++i) {
    if (std::isnan(list.values[i])) continue;
    return Error(ErrorCode::kInvalidArgument,
                 "`" + part + "` has " + std::to_string(list.values.size()) +
                     " numbers; a list of x, y, z, x, y, z, … needs a multiple of three");
  }
  return Transposed(
      {.rows = 3, .columns = list.values.size() / 3, .values = std::move(list.values)});
}

Result<Vectors> ReadVectors(const Inputs& inputs,
                            const std::string& reference,
                            std::size_t expected,
                            const std::string& preferred = "") {
  Vectors vectors;
  const std::vector<std::string> parts = Split(reference, '+');
  for (const std::string& part : parts) {
    const std::size_t colon = part.find(':');
    TRUETRIAD_ASSIGN_OR_RETURN(const Variable* const variable,
                               inputs.Find(part.substr(0, colon), preferred));
    if (vectors.columns.empty()) vectors.path = variable->path;
    TRUETRIAD_ASSIGN_OR_RETURN(Matrix matrix, variable->read());
    const std::string range = colon == std::string::npos ? "" : part.substr(colon + 1);
    std::optional<std::pair<std::uint32_t, std::uint32_t>> wanted = ParseRange(range);
    if (range == "xyz") {
      TRUETRIAD_ASSIGN_OR_RETURN(matrix, InTurn(std::move(matrix), part));
      wanted = {1, 3};
    } else if (colon == std::string::npos) {
      matrix = Upright(std::move(matrix), expected / parts.size());
      wanted = {1, matrix.columns};
    } else if (!wanted || wanted->second > matrix.columns) {
      return Error(ErrorCode::kInvalidArgument,
                   "`" + part + "`: expected column numbers from 1 to " +
                       std::to_string(matrix.columns) + ", as in data:2-4, or data:xyz");
    }
    for (std::size_t column = wanted->first; column <= wanted->second; ++column) {
      const auto begin =
          matrix.values.begin() + static_cast<std::ptrdiff_t>((column - 1) * matrix.rows);
      vectors.columns.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(matrix.rows));
    }
  }
  if (vectors.columns.size() != expected) {
    return Error(ErrorCode::kInvalidArgument,
                 "`" + reference + "` has " + std::to_string(vectors.columns.size()) +
                     " columns; expected " + std::to_string(expected));
  }
  return vectors;
}

/// The times of `count` samples in ns; for time=none, their indices.
Result<std::vector<std::int64_t>> ReadTimes(const Inputs& inputs,
                                            const std::string& reference,
                                            const ByRole& units,
                                            std::size_t count,
                                            const std::string& path) {
  std::vector<std::int64_t> times;
  if (reference == kNoTime) {
    for (std::size_t i = 0; i < count; ++i) times.push_back(static_cast<std::int64_t>(i));
    return times;
  }
  if (IsRate(reference)) {
    const std::optional<double> rate_hz = ParseRate(reference);
    if (!rate_hz) {
      return Error(ErrorCode::kInvalidArgument,
                   "--columns: time=" + reference + ": expected a rate, as in time=100Hz");
    }
    for (std::size_t i = 0; i < count; ++i) {
      times.push_back(std::llround(static_cast<double>(i) * 1e9 / *rate_hz));
    }
    return times;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Vectors vectors, ReadVectors(inputs, reference, 1, path));
  const double ns = *NanosecondsPer(units.at("time"));
  constexpr double kLast = 9.2e18;  // Nanoseconds must fit into 64 bits: 2^63 = 9.22e18.
  for (const double value : vectors.columns[0]) {
    const double time_ns = value * ns;
    if (!(std::abs(time_ns) < kLast)) {
      return Error(
          ErrorCode::kUnreadableNumber,
          {path},
          "time " + reference + " contains a time that is not a number or not a valid date");
    }
    times.push_back(std::llround(time_ns));
  }
  return times;
}

/// Temperatures of `count` readings of the file `path` in degC; empty if there are none.
Result<std::vector<double>> ReadTemperatures(const Inputs& inputs,
                                             const ByRole& columns,
                                             const ByRole& units,
                                             std::size_t count,
                                             const std::string& path) {
  const auto stated = columns.find("temperature");
  if (stated == columns.end()) return std::vector<double>();
  const Result<Vectors> vectors = ReadVectors(inputs, stated->second, 1, path);
  if (!vectors && vectors.error().kind() == ErrorKind::kUsage) return vectors.error();
  if (!vectors) {
    Note(vectors.error().message + "; converted without temperature");
    return std::vector<double>();
  }
  std::vector<double> temperatures = vectors->columns[0];
  if (temperatures.size() != count) {
    return Error(ErrorCode::kDoesNotMatch,
                 {path},
                 "temperature " + stated->second + " has " + std::to_string(temperatures.size()) +
                     " values for " + std::to_string(count) +
                     " readings; leave it out (--columns without temperature), or complete it");
  }
  const TemperatureUnit unit = *ParseTemperatureUnit(units.at("temperature"));
  for (double& value : temperatures) value = unit.scale * value + unit.offset;
  return temperatures;
}

/// The input data of one triad.
struct TriadReadings {
  Triad triad = Triad::kAccelerometer;
  std::vector<std::vector<double>> axes;
  std::vector<std::int64_t> times_ns;
  std::vector<double> temperatures_degc;  ///< Empty: there are none.
};

/// Reads the triads. An incomplete triad is skipped with a note; if `are_named`, it is an error.
Result<std::vector<TriadReadings>> ReadTriads(const Inputs& inputs,
                                              const ByRole& columns,
                                              bool are_named,
                                              const ByRole& units) {
  std::vector<TriadReadings> all;
  for (const Triad triad : kTriads) {
    const auto stated = columns.find(std::string(TriadName(triad)));
    if (stated == columns.end()) continue;
    const TimedReference reference = SplitTime(stated->second);
    const Result<Vectors> axes = ReadVectors(inputs, reference.readings, 3);
    if (!axes && axes.error().kind() == ErrorKind::kBadInput && are_named) {
      Error error = axes.error();
      error.message += "; to convert the other sensors, leave the " +
                       std::string(TriadName(triad)) + " out of --columns";
      return error;
    }
    if (!axes && axes.error().kind() == ErrorKind::kBadInput) {
      Note(axes.error().message + "; sensor skipped");
      continue;
    }
    TRUETRIAD_RETURN_IF_ERROR(axes);
    const std::size_t count = axes->columns[0].size();
    const std::string time = reference.time.empty() ? columns.at("time") : reference.time;
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::int64_t> times,
                               ReadTimes(inputs, time, units, count, axes->path));
    for (const std::vector<double>& axis : axes->columns) {
      if (axis.size() == times.size()) continue;
      return Error(ErrorCode::kDoesNotMatch,
                   {axes->path},
                   reference.readings + " has " + std::to_string(axis.size()) +
                       " samples, but its time " + time + " has " + std::to_string(times.size()) +
                       "; name a sensor's own time as in accelerometer=acc@t_acc");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<double> temperatures,
                               ReadTemperatures(inputs, columns, units, count, axes->path));
    all.push_back({triad, axes->columns, times, std::move(temperatures)});
  }
  return all;
}

/// Adds a table of sensors that share rows. Row i has the i-th reading of each sensor, at the time
/// of the first sensor; a missing reading does not shift the others.
void AddTable(const std::string& file,
              bool has_time,
              std::span<const TriadReadings> group,
              const ByRole& units,
              RecordingFolder* folder) {
  std::vector<TriadColumns> triads;
  const std::vector<double>* temperatures = nullptr;
  for (const TriadReadings& readings : group) {
    const std::string name(TriadName(readings.triad));
    triads.push_back({.triad = readings.triad, .unit = units.at(name), .applied = {}});
    if (!readings.temperatures_degc.empty()) temperatures = &readings.temperatures_degc;
  }
  Table* const table = folder->AddTable(
      file, std::move(triads), {.has_temperature = temperatures != nullptr, .has_time = has_time});
  for (std::size_t i = 0; i < group[0].times_ns.size(); ++i) {
    if (temperatures != nullptr) table->SetTemperature((*temperatures)[i]);
    std::vector<double> row;
    for (const TriadReadings& readings : group) {
      for (const std::vector<double>& axis : readings.axes) row.push_back(axis[i]);
    }
    table->Add(group[0].times_ns[i], row.data());
  }
}

/// Adds all triads as tables. Error: sensors without a time have different numbers of rows.
Status AddTables(const std::vector<TriadReadings>& all,
                 bool has_time,
                 const ByRole& units,
                 RecordingFolder* folder) {
  for (const TriadReadings& readings : all) {
    const std::string name(TriadName(readings.triad));
    if (has_time) {
      AddTable(name + ".csv", has_time, {&readings, 1}, units, folder);
    } else if (readings.times_ns.size() != all[0].times_ns.size()) {
      return Error(ErrorCode::kDoesNotMatch,
                   "the " + name + " has " + std::to_string(readings.times_ns.size()) +
                       " rows, but the " + std::string(TriadName(all[0].triad)) + " has " +
                       std::to_string(all[0].times_ns.size()) +
                       "; without a time, each row must have a reading of both");
    }
  }
  if (!has_time && !all.empty()) AddTable("recording.csv", has_time, all, units, folder);
  return {};
}

void List(const Inputs& inputs) {
  for (const Variable& variable : inputs.variables) {
    std::printf("%-32s %12s  %s\n",
                PrintableLine(variable.full_name).c_str(),
                Shape(variable).c_str(),
                variable.type.c_str());
  }
}

Status ConvertInputs(Inputs inputs, const Arguments& arguments, const std::string& format) {
  if (inputs.variables.empty()) {
    return Error(ErrorCode::kNoReadings, {inputs.paths[0]}, "contains no complete numeric matrix");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const ByRole columns, ChooseColumns(inputs, arguments));
  const bool has_triad = std::any_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
    return columns.contains(std::string(TriadName(triad)));
  });
  TRUETRIAD_ASSIGN_OR_RETURN(const bool have_times, HaveTimes(columns));
  if (!has_triad || !have_times) {
    return Error(
        ErrorCode::kMissingArgument,
        "the names do not show which variables are the " +
            std::string(has_triad ? "time" : "readings") +
            "; state them, as in --columns=time=t,accelerometer=imu.acc,gyroscope=gx+gy+gz "
            "(time=100Hz if the file has no time; time=none if each row is the reading of one "
            "rest). "
            "There are " +
            inputs.All());
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const ByRole units, ReadUnits(columns, arguments));
  // All data are read before anything is written, since a damaged file can crash a library.
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::vector<TriadReadings> all,
      ReadTriads(inputs, columns, arguments.others.contains("columns"), units));
  inputs.variables.clear();  // This closes the files.
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<RecordingFolder> folder,
                             RecordingFolder::Create(arguments.output));
  folder->SetOrigin(format, inputs.paths);
  for (const auto& [role, column] : columns) folder->SetSource(role, column);
  std::size_t wanted = 0;
  for (const Triad triad : kTriads) wanted += columns.count(std::string(TriadName(triad)));
  if (all.size() < wanted) {
    folder->SetSource("incomplete variables", std::to_string(wanted - all.size()));
  }
  const auto time = columns.find("time");
  const bool has_time = time == columns.end() || time->second != kNoTime;
  TRUETRIAD_RETURN_IF_ERROR(AddTables(all, has_time, units, folder.get()));
  return folder->Commit();
}

}  // namespace

Status ConvertNamedReadings(const NamedFormat& format, const Arguments& arguments) {
  BoundMemory(arguments.inputs);
  Inputs inputs;
  inputs.paths = arguments.inputs;
  for (const std::string& path : inputs.paths) {
    TRUETRIAD_ASSIGN_OR_RETURN(VariableFile file, format.open(path));
    if (!file.damage.empty()) Note(path + ": " + file.damage);
    inputs.is_damaged = inputs.is_damaged || !file.damage.empty();
    inputs.others.merge(file.others);
    const bool is_one = inputs.paths.size() == 1;
    for (Variable& variable : file.variables) {
      variable.path = path;
      variable.full_name =
          (is_one ? "" : std::filesystem::path(path).stem().string() + "/") + variable.name;
      inputs.variables.push_back(std::move(variable));
    }
  }
  if (!arguments.list) return ConvertInputs(std::move(inputs), arguments, std::string(format.name));
  List(inputs);
  return {};
}

int RunNamedReadingsConverter(const NamedFormat& format, int argc, char** argv) {
  return RunConverter(
      {.format = format.name,
       .flags = {"columns", "units"},
       .takes_several = true,
       .run = [&](const Arguments& arguments) { return ConvertNamedReadings(format, arguments); }},
      argc,
      argv);
}

}  // namespace truetriad::convert
