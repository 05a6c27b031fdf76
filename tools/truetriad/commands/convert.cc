// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <gflags/gflags.h>

#include "base/companion.h"
#include "base/spelling.h"
#include "io/mapping.h"
#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/companion_program.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/format_flags.h"
#include "tools/truetriad/mappings.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

DECLARE_string(from);
DEFINE_string(topic,
              "",
              "topics or messages to convert if the log has several, separated by commas");
DEFINE_bool(list, false, "only list what the log contains: topics, instances, variables");
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

/// A format that a converter program reads.
struct LogFormat {
  std::string_view name;
  std::string_view description;
  std::string_view needs;  ///< What to install where the program is missing; empty: always built.
  bool is_script = false;  ///< Runs under Node.
};

constexpr std::array<LogFormat, 11> kLogFormats = {{
    {"dataflash", "ArduPilot DataFlash log (.bin)", "", false},
    {"ros1", "ROS 1 bag (.bag)", "libbz2-dev and liblz4-dev", false},
    {"ros2-db3", "ROS 2 bag in SQLite (.db3)", "libsqlite3-dev and libfastcdr-dev", false},
    {"mat", "MATLAB files (.mat, v5 to v7.3)", "libmatio-dev", false},
    {"json", "JSON files with arrays of readings, or one object a line", "", false},
    {"vectornav", "VectorNav ASCII sentences ($VNYMR, $VNIMU, …)", "", false},
    {"six-face", "folder with one recording for each face: +x.csv, -x.csv, …", "", false},
    {"gnss-ins-sim", "folder of gnss-ins-sim: time.csv, accel-0.csv, …", "", false},
    {"mcap", "ROS 2 bag in MCAP (.mcap)", "", true},
    {"ulog", "PX4 ULog (.ulg)", "", true},
    {"parquet", "Parquet table (.parquet)", "", true},
}};

const LogFormat* FindFormat(std::string_view name) {
  const auto* const found = std::find_if(
      kLogFormats.begin(), kLogFormats.end(), [&](const LogFormat& f) { return f.name == name; });
  return found == kLogFormats.end() ? nullptr : found;
}

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

Result<VerbResult> ConvertLog(const LogFormat& format) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string program, FindConverter(format));
  std::vector<std::string> arguments = {FLAGS_input};
  const auto pass = [&](const std::string& flag, const std::string& value) {
    if (!value.empty()) arguments.push_back("--" + flag + "=" + value);
  };
  pass("output", FLAGS_output);
  pass("topic", FLAGS_topic);
  pass("instance", FLAGS_instance);
  pass("columns", FLAGS_columns);
  pass("units", FLAGS_units);
  pass("layout", FLAGS_layout);
  if (FLAGS_list) arguments.push_back("--list");
  if (FLAGS_json) arguments.push_back("--json");
  TRUETRIAD_ASSIGN_OR_RETURN(const ProgramRun conversion,
                             RunProgram(program, arguments, FLAGS_json));
  if (FLAGS_json && conversion.exit_code != kExitGood) return ErrorFrom(conversion);
  std::fputs(conversion.err.c_str(), stderr);
  return VerbResult{.exit_code = conversion.exit_code,
                    .result = {{"output", FLAGS_output}, {"text", conversion.out}}};
}

/// Whether the manifest can be opened, and what it holds.
Result<std::string> DescribeStreams(const std::string& manifest) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, OpenRecording(manifest));
  std::string text;
  for (const StreamInfo& stream : source->info().streams) {
    text += (text.empty() ? "" : ", ") + std::string(TriadName(stream.triad)) + " in " +
            stream.unit.name;
  }
  return text;
}

Result<VerbResult> ConvertTable(const std::string& name, const std::string& mapping) {
  if (FLAGS_list || !FLAGS_topic.empty() || !FLAGS_instance.empty() || !FLAGS_columns.empty() ||
      !FLAGS_units.empty() || !FLAGS_layout.empty()) {
    return Error(ErrorCode::kConflictingArguments,
                 "--from=" + name +
                     " has fixed columns: --list, --topic, --instance, --columns, --units and "
                     "--layout do not "
                     "apply");
  }
  const std::vector<std::string> inputs = CommaSeparated(FLAGS_input);
  const bool is_new = !fs::exists(FLAGS_output);
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  const std::string path = (fs::path(FLAGS_output) / "recording.yaml").string();
  const std::string draft = TemporaryNameBeside(path) + ".yaml";
  std::string manifest;
  const auto write = [&]() -> Result<std::string> {
    TRUETRIAD_ASSIGN_OR_RETURN(manifest, ManifestFromMapping(mapping, name, inputs, FLAGS_output));
    TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(draft, manifest));
    return DescribeStreams(draft);
  };
  const Result<std::string> streams = write();
  std::error_code ignored;
  fs::remove(draft, ignored);
  if (!streams) {
    if (is_new) fs::remove(FLAGS_output, ignored);
    return streams.error();
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(path, manifest));
  Note("truetriad convert: " + *streams);
  return VerbResult{.text = path + '\n', .result = {{"output", path}}};
}

std::vector<std::string_view> FormatNames() {
  std::vector<std::string_view> names = {"bbl"};
  for (const LogFormat& format : kLogFormats) names.push_back(format.name);
  for (const ShippedMapping& mapping : ShippedMappings()) names.push_back(mapping.name);
  return names;
}

Result<VerbResult> RunConvert(const std::vector<std::string>& words) {
  for (const std::string& word : words) FLAGS_input += (FLAGS_input.empty() ? "" : ",") + word;
  if (FLAGS_output.empty() && !FLAGS_list) {
    return Error(ErrorCode::kMissingArgument,
                 "no --output given; name the folder for the recording, or use --list");
  }
  if (const LogFormat* const format = FindFormat(FLAGS_from)) return ConvertLog(*format);
  for (const ShippedMapping& mapping : ShippedMappings()) {
    if (mapping.name == FLAGS_from) return ConvertTable(FLAGS_from, std::string(mapping.text));
  }
  if (FLAGS_from == "bbl" || FLAGS_from == "bfl") {
    return Error(ErrorCode::kConflictingArguments,
                 "--from=" + FLAGS_from +
                     ": is a Betaflight blackbox log; decode it with Betaflight's own "
                     "blackbox_decode --unit-rotation rad/s --unit-acceleration m/s2 LOG.BBL, "
                     "then truetriad convert --from=blackbox --input=LOG.01.csv");
  }
  if (FLAGS_from.ends_with(".yaml") || FLAGS_from.ends_with(".yml")) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string mapping, ReadMappingFile(FLAGS_from));
    return ConvertTable(FLAGS_from, mapping);
  }
  return Error(ErrorCode::kUnknownName,
               "--from=" + FLAGS_from + " is not a format" + DidYouMean(FLAGS_from, FormatNames()) +
                   "; `truetriad help convert` lists them; your own mapping is a .yaml file");
}

std::vector<std::string> FormatChoices() {
  std::vector<std::string> choices;
  for (const std::string_view name : FormatNames()) choices.emplace_back(name);
  return choices;
}

std::string FormatList() {
  std::string text = "Formats:\n";
  const auto add = [&](std::string_view format, std::string_view description) {
    std::string name(format);
    name.resize(14, ' ');
    text.append("  ").append(name).append(description).append("\n");
  };
  for (const LogFormat& format : kLogFormats) add(format.name, format.description);
  for (const ShippedMapping& mapping : ShippedMappings()) {
    const Result<MappingInfo> info =
        ReadMappingInfo(std::string(mapping.text), std::string(mapping.name));
    if (info) add(mapping.name, info->about);
  }
  add("FILE.yaml", "your own mapping, like those in configs/mappings");
  return text;
}

}  // namespace

Command ConvertCommand() {
  return {.name = "convert",
          .summary = "How do I turn another system's log into a recording?",
          .examples =
              "build/truetriad convert --from=kalibr-csv --input=datasets/foreign/imu0.csv "
              "--output=out/foreign\n"
              "build/truetriad inspect --input=out/foreign/recording.yaml",
          .details =
              "\nWrites DIR/recording.yaml and its CSV files, the --input of every verb. The "
              "complete parts\nof a damaged log are converted and the rest is counted. A mapping "
              "writes only the\nmanifest, which refers to the log in place; separate several files "
              "by commas. Details of\neach format: docs/converting.md.\n",
          .list = FormatList,
          .flags = {{"from", "FORMAT", true, FormatChoices()},
                    {"input", "FILE,...", true},
                    {"output", "DIR"},
                    {"list", "true"},
                    {"topic", "NAME[,NAME]"},
                    {"instance", "N"},
                    {"columns", "WHAT=NAME[,WHAT=NAME]"},
                    {"units", "UNIT[,UNIT]"},
                    {"layout", "FILE.msg"}},
          .more_words = "input",
          .run = RunConvert};
}

}  // namespace truetriad
