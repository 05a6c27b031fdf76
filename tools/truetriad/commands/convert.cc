// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include <gflags/gflags.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/companion.h"
#include "base/spelling.h"
#include "io/mapping.h"
#include "io/text_file.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "report/table.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/log_conversion.h"
#include "tree/json.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

DECLARE_string(from);
DEFINE_string(
    topic,
    "",
    "NAME[,NAME]: topics or messages to convert if the log has several, separated by commas");
DEFINE_string(columns,
              "",
              "ROLE=NAME[,ROLE=NAME]: the variable for each role in a file without a fixed layout, "
              "as in time=t,accelerometer=imu.acc,gyroscope=gyr");
DEFINE_string(
    layout,
    "",
    "FILE.msg: file with the definition of a ROS message type (.msg), if the bag has none");
DEFINE_bool(list, false, "only list what the log contains: topics, instances, variables");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kNode = "nodejs 18 or newer, and npm";
constexpr std::string_view kPackers = "libbz2-dev, liblz4-dev and libzstd-dev";

constexpr std::array<LogFormat, 11> kLogFormats = {{
    {"dataflash",
     "ArduPilot DataFlash log (.bin)",
     "",
     "ArduPilot logs while unarmed if LOG_DISARMED=1, and logs what a calibration needs if "
     "LOG_BITMASK includes IMU, raw IMU and compass"},
    {"ros1", "ROS 1 bag (.bag)", kPackers},
    {"ros2-db3", "ROS 2 bag in SQLite (.db3)", "libsqlite3-dev"},
    {"mat", "MATLAB files (.mat, v5 to v7.3)", "libmatio-dev"},
    {"json", "JSON files with arrays of readings, or one object a line"},
    {"vectornav", "VectorNav ASCII sentences ($VNYMR, $VNIMU, …)"},
    {"six-face", "folder with one recording for each face: +x.csv, -x.csv, …"},
    {"gnss-ins-sim", "folder of gnss-ins-sim: time.csv, accel-0.csv, …"},
    {"mcap", "ROS 2 bag in MCAP (.mcap)", kPackers},
    {"ulog",
     "PX4 ULog (.ulg)",
     kNode,
     "PX4 logs while unarmed if SDLOG_MODE=2 (or 1), and logs raw readings of all sensors if "
     "SDLOG_PROFILE includes sensor comparison"},
    {"parquet", "Parquet table (.parquet)", kNode},
}};

/// The format of a folder, by the end of the name of a file in the folder.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kFolders = {
    {{".db3", "ros2-db3"},
     {".mcap", "mcap"},
     {".bag", "ros1"},
     {"+x.csv", "six-face"},
     {"x_up.csv", "six-face"},
     {"accel-0.csv", "gnss-ins-sim"}}};

bool IsInPath(std::string_view program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

/// The output of a child process: an unnamed file, read after the child has ended.
using Captured = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string TextOf(const Captured& stream) {
  if (stream == nullptr) return "";
  std::string text;
  std::rewind(stream.get());
  std::array<char, 4096> part{};
  for (std::size_t n = 0; (n = std::fread(part.data(), 1, part.size(), stream.get())) > 0;) {
    text.append(part.data(), n);
  }
  return text;
}

/// The path of a program of this distribution. Error (usage): the program is missing. The message
/// begins with the `flag` that needs the program, and states what to install.
Result<std::string> FindProgram(const std::string& program,
                                const std::string& flag,
                                std::string_view needs) {
  // In a build tree without Node's packages the program is found in convert-node/bin, and reports
  // that they are missing.
  for (const std::string& name : {program, "convert-node/bin/" + program}) {
    if (const std::optional<std::string> found = FindCompanion(name)) return *found;
  }
  return Error(ErrorCode::kMissingProgram,
               flag + ": " + program +
                   " is not beside truetriad; build it with tools/build.sh programs" +
                   (needs.empty() ? ", or install truetriad again"
                                  : " (it needs " + std::string(needs) + ")"));
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

const LogFormat* FindLogFormat(std::string_view name) {
  for (const LogFormat& format : kLogFormats) {
    if (format.name == name) return &format;
  }
  return nullptr;
}

/// Runs the format's converter with --topic, --instance, --columns, --units and --layout. With
/// `captures` nothing is shown, and the converter's error is returned. Error (usage): the converter
/// is missing; the message states what to install.
Result<ProgramRun> RunLogConverter(const LogFormat& format,
                                   const std::string& log,
                                   const std::string& folder,
                                   bool lists,
                                   bool captures) {
  const std::string name(format.name);
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::string program,
      FindProgram("truetriad-convert-" + name, "--from=" + name, format.needs));
  std::vector<std::string> arguments = {log};
  for (const auto& [flag, value] : {std::pair<const char*, const std::string&>("--output=", folder),
                                    {"--topic=", FLAGS_topic},
                                    {"--instance=", FLAGS_instance},
                                    {"--columns=", FLAGS_columns},
                                    {"--units=", FLAGS_units},
                                    {"--layout=", FLAGS_layout}}) {
    if (!value.empty()) arguments.push_back(flag + value);
  }
  if (lists) arguments.emplace_back("--list");
  if (captures) arguments.emplace_back("--json");
  TRUETRIAD_ASSIGN_OR_RETURN(ProgramRun conversion, RunProgram(program, arguments, captures));
  if (captures && conversion.exit_code != 0) return ErrorFrom(conversion);
  return conversion;
}

Result<VerbResult> ConvertLog(const LogFormat& format) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const ProgramRun conversion,
      RunLogConverter(format, FLAGS_input, FLAGS_output, FLAGS_list, FLAGS_json));
  std::fputs(conversion.err.c_str(), stderr);
  return VerbResult{.exit_code = conversion.exit_code,
                    .result = {{"output", FLAGS_output}, {"text", conversion.out}}};
}

/// Describes the contents of the manifest. Error: it cannot be opened.
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
  if (FLAGS_list ||
      !(FLAGS_topic + FLAGS_instance + FLAGS_columns + FLAGS_units + FLAGS_layout).empty()) {
    return Error(ErrorCode::kConflictingArguments,
                 "--from=" + name +
                     " has fixed columns: --list, --topic, --instance, --columns, --units and "
                     "--layout do not apply");
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

std::vector<std::string> FormatNames() {
  std::vector<std::string> names = {"bbl"};
  std::ranges::move(NamesOf(kLogFormats), std::back_inserter(names));
  std::ranges::move(NamesOf(ShippedMappings()), std::back_inserter(names));
  return names;
}

Result<VerbResult> RunConvert(const std::vector<std::string>& words) {
  for (const std::string& word : words) FLAGS_input += (FLAGS_input.empty() ? "" : ",") + word;
  if (FLAGS_output.empty() && !FLAGS_list) {
    return Error(ErrorCode::kMissingArgument,
                 "no --output given; name the folder for the recording, or use --list");
  }
  if (const LogFormat* const format = FindLogFormat(FLAGS_from)) return ConvertLog(*format);
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
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string mapping, ReadSmallFile(FLAGS_from));
    return ConvertTable(FLAGS_from, mapping);
  }
  const std::vector<std::string> names = FormatNames();
  return Error(ErrorCode::kUnknownName,
               "--from=" + FLAGS_from + " is not a format" +
                   DidYouMean(FLAGS_from, {names.begin(), names.end()}) +
                   "; `truetriad help convert` lists them; your own mapping is a .yaml file");
}

std::string FormatList() {
  Table table{.header = {}, .alignment = "ll", .rows = {}};
  for (const LogFormat& format : kLogFormats) table.Add() << format.name << format.description;
  for (const ShippedMapping& mapping : ShippedMappings()) {
    const Result<MappingInfo> info =
        ReadMappingInfo(std::string(mapping.text), std::string(mapping.name));
    if (info) table.Add() << mapping.name << info->about;
  }
  table.Add() << "FILE.yaml"
              << "your own mapping, like those in configs/mappings";
  return "Formats:\n" + TextOf(table);
}

}  // namespace

Result<std::string> FindNodeProgram(const std::string& program, const std::string& flag) {
  if (IsInPath("node")) return FindProgram(program, flag, kNode);
  return Error(ErrorCode::kMissingProgram,
               flag +
                   ": needs Node.js, which is not in PATH; install nodejs (and npm to set up "
                   "tools/convert-node)");
}

Result<ProgramRun> RunProgram(const std::string& program,
                              const std::vector<std::string>& arguments,
                              bool captures) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  std::fflush(stdout);
  const Captured out(captures ? std::tmpfile() : nullptr, std::fclose),
      err(captures ? std::tmpfile() : nullptr, std::fclose);
  if (captures && (out == nullptr || err == nullptr)) {
    return Error(ErrorCode::kSystemFailure,
                 std::string("no temporary file: ") + std::strerror(errno));
  }
  const int out_to = captures ? fileno(out.get()) : STDOUT_FILENO;
  const int err_to = captures ? fileno(err.get()) : STDERR_FILENO;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    return Error(ErrorCode::kSystemFailure,
                 {program},
                 std::string("cannot be started: ") + std::strerror(errno));
  }
  constexpr int kCannotStart = 127;  // As the shell's exit code.
  if (child == 0) {
    // If the parent is gone, the child must not write into a folder that another process may use.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent || dup2(out_to, STDOUT_FILENO) < 0 || dup2(err_to, STDERR_FILENO) < 0) {
      _exit(kCannotStart);
    }
    execv(program.c_str(), pointers.data());
    _exit(kCannotStart);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return Error(ErrorCode::kSystemFailure, {program}, std::strerror(errno));
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == kCannotStart) {
    return Error(ErrorCode::kSystemFailure, {program}, "cannot be started");
  }
  if (WIFEXITED(status)) {
    return ProgramRun{WEXITSTATUS(status), TextOf(out), TextOf(err)};
  }
  return Error(ErrorCode::kDamagedFile,
               program + " was stopped by signal " + std::to_string(WTERMSIG(status)) +
                   "; its output is either complete or was not written");
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

Result<std::map<int, std::string>> ConvertedLog(const LogFormat& format,
                                                const std::string& log,
                                                const std::string& folder) {
  TRUETRIAD_ASSIGN_OR_RETURN(const ProgramRun conversion,
                             RunLogConverter(format, log, folder, /*lists=*/false, true));
  Note(log + ": " + std::string(format.description) + ", converted into " + folder);
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

Command ConvertCommand() {
  return {
      .name = "convert",
      .summary = "How do I turn another system's log into a recording?",
      .examples =
          R"(build/truetriad convert --from=kalibr-csv --input=datasets/foreign/imu0.csv --output=out/foreign
build/truetriad inspect --input=out/foreign/recording.yaml)",
      .details = R"(
Writes DIR/recording.yaml and its CSV files, the --input of every verb. The complete parts
of a damaged log are converted and the rest is counted. With a mapping, only the manifest is
written, which refers to the log in place; separate several files by commas. Details of
each format: docs/converting.md.
)",
      .list = FormatList,
      .flags = "from! input=FILE,...! output list=true topic instance columns units layout",
      .values = {{"from", FormatNames()}},
      .more_words = "input",
      .run = RunConvert};
}

}  // namespace truetriad
