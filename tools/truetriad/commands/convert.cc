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

#include "base/spelling.h"
#include "io/mapping.h"
#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/format_flags.h"
#include "tools/truetriad/log_conversion.h"
#include "tools/truetriad/mappings.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

DECLARE_string(from);
DEFINE_bool(list, false, "only list what the log contains: topics, instances, variables");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

Result<VerbResult> ConvertLog(const LogFormat& format) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const ProgramRun conversion,
      RunLogConverter(format, FLAGS_input, FLAGS_output, FLAGS_list, FLAGS_json));
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
  for (const LogFormat& format : LogFormats()) names.push_back(format.name);
  for (const ShippedMapping& mapping : ShippedMappings()) names.push_back(mapping.name);
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
  for (const LogFormat& format : LogFormats()) add(format.name, format.description);
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
