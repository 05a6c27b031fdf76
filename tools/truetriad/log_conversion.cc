// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/log_conversion.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "base/companion.h"
#include "io/text_file.h"
#include "json/json.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/format_flags.h"

DEFINE_string(topic,
              "",
              "topics or messages to convert if the log has several, separated by commas");
DEFINE_string(columns,
              "",
              "which variable of a file without a layout of its own is what, as in "
              "time=t,accelerometer=imu.acc,gyroscope=gyr");
DEFINE_string(layout,
              "",
              "file with the definition of a ROS message type (.msg), where the bag has none");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::array<LogFormat, 11> kLogFormats = {{
    {"dataflash",
     "ArduPilot DataFlash log (.bin)",
     "",
     false,
     "ArduPilot logs unarmed with LOG_DISARMED=1, and what a calibration needs with IMU, raw IMU "
     "and compass in LOG_BITMASK"},
    {"ros1", "ROS 1 bag (.bag)", "libbz2-dev and liblz4-dev"},
    {"ros2-db3", "ROS 2 bag in SQLite (.db3)", "libsqlite3-dev"},
    {"mat", "MATLAB files (.mat, v5 to v7.3)", "libmatio-dev"},
    {"json", "JSON files with arrays of readings, or one object a line"},
    {"vectornav", "VectorNav ASCII sentences ($VNYMR, $VNIMU, …)"},
    {"six-face", "folder with one recording for each face: +x.csv, -x.csv, …"},
    {"gnss-ins-sim", "folder of gnss-ins-sim: time.csv, accel-0.csv, …"},
    {"mcap", "ROS 2 bag in MCAP (.mcap)", "", true},
    {"ulog",
     "PX4 ULog (.ulg)",
     "",
     true,
     "PX4 logs unarmed with SDLOG_MODE=2 (or 1), and raw readings of all sensors with sensor "
     "comparison in SDLOG_PROFILE"},
    {"parquet", "Parquet table (.parquet)", "", true},
}};

/// How the name of a file ends that shows what kind of folder it is in.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kFolders = {
    {{".db3", "ros2-db3"},
     {".mcap", "mcap"},
     {".bag", "ros1"},
     {"+x.csv", "six-face"},
     {"x_up.csv", "six-face"},
     {"accel-0.csv", "gnss-ins-sim"}}};

/// The converter of `format`. Error (usage): it is not there; says what to install.
Result<std::string> FindConverter(const LogFormat& format) {
  const std::string program = "truetriad-convert-" + std::string(format.name);
  if (format.is_script) return FindNodeProgram(program, "--from=" + std::string(format.name));
  const std::optional<std::string> found = FindCompanion(program);
  if (found) return *found;
  std::string what =
      "--from=" + std::string(format.name) + ": " + program + " is not beside truetriad; ";
  if (!format.needs.empty()) {
    what += "build it with tools/build.sh programs (it needs " + std::string(format.needs) + ")";
  } else {
    what += "build it with tools/build.sh programs, or install truetriad again";
  }
  return Error(ErrorCode::kMissingProgram, what);
}

/// The error that a converter wrote as JSON.
Error ErrorFrom(const ProgramRun& conversion) {
  const Json json = Json::parse(conversion.out, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("error")) {
    return Error(ErrorCode::kDamagedFile, conversion.err);
  }
  const Json& stated = json["error"];
  Error error(ErrorCode::kWrongFormat, stated.value("message", ""));
  for (const ErrorInfo& info : AllErrorCodes()) {
    if (info.name == stated.value("code", "")) error.code = info.code;
  }
  error.place = {
      stated.value("file", ""), stated.value("line", std::int64_t{0}), stated.value("column", 0)};
  return error;
}

}  // namespace

std::span<const LogFormat> LogFormats() { return kLogFormats; }

const LogFormat* FindLogFormat(std::string_view name) {
  const auto* const found = std::find_if(
      kLogFormats.begin(), kLogFormats.end(), [&](const LogFormat& f) { return f.name == name; });
  return found == kLogFormats.end() ? nullptr : found;
}

const LogFormat* LogFormatOf(const std::string& log) {
  std::error_code failure;
  if (!fs::is_directory(log, failure)) return FindLogFormat(ForeignFormatOf(log));
  for (fs::directory_iterator entry(log, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    for (const auto& [ending, name] : kFolders) {
      if (entry->path().string().ends_with(ending)) return FindLogFormat(name);
    }
  }
  return nullptr;
}

Result<ProgramRun> RunLogConverter(const LogFormat& format,
                                   const std::string& log,
                                   const std::string& folder,
                                   bool lists,
                                   bool captures) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string program, FindConverter(format));
  std::vector<std::string> arguments = {log};
  const auto pass = [&](const std::string& flag, const std::string& value) {
    if (!value.empty()) arguments.push_back("--" + flag + "=" + value);
  };
  pass("output", folder);
  pass("topic", FLAGS_topic);
  pass("instance", FLAGS_instance);
  pass("columns", FLAGS_columns);
  pass("units", FLAGS_units);
  pass("layout", FLAGS_layout);
  if (lists) arguments.emplace_back("--list");
  if (captures) arguments.emplace_back("--json");
  TRUETRIAD_ASSIGN_OR_RETURN(ProgramRun conversion, RunProgram(program, arguments, captures));
  if (captures && conversion.exit_code != 0) return ErrorFrom(conversion);
  return conversion;
}

Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder) {
  Note(log + ": " + std::string(format.description) + ", converted into " + folder);
  TRUETRIAD_ASSIGN_OR_RETURN(const ProgramRun conversion,
                             RunLogConverter(format, log, folder, /*lists=*/false, true));
  std::istringstream notes(conversion.err), manifests(conversion.out);
  for (std::string note; std::getline(notes, note);) Note(note);
  std::map<int, std::string> recordings;
  for (std::string path; std::getline(manifests, path);) {
    const std::string name = fs::path(path).stem().string();
    const std::size_t number = name.find('-');
    const std::string text = number == std::string::npos ? FLAGS_instance : name.substr(number + 1);
    recordings.emplace(std::atoi(text.c_str()), path);
  }
  return recordings;
}

}  // namespace truetriad
