// SPDX-License-Identifier: Apache-2.0
#include "truetriad/allan/allan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "allan/allan_file.h"
#include "allan/allan_report.h"
#include "io/whole_file.h"
#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/base/version.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

DEFINE_double(rate_hz, 0.0, "samples per second, for a log without time");
DEFINE_string(white_range,
              "",
              "tau range in seconds for fitting the noise density, as in 0.3,3 (default: chosen "
              "from the curve)");

DECLARE_string(to);

namespace truetriad {
namespace {

/// Programs that are told of a sensor's noise.
constexpr std::array<std::string_view, 3> kNoiseFormats = {"kalibr", "openvins", "ros2"};

/// "0.3,3" as two numbers.
Result<std::optional<std::array<double, 2>>> ParseRange(const std::string& text) {
  if (text.empty()) return std::optional<std::array<double, 2>>();
  std::array<double, 2> range{};
  const char* const end = text.data() + text.size();
  const auto low = std::from_chars(text.data(), end, range[0]);
  if (low.ec == std::errc() && low.ptr != end && *low.ptr == ',') {
    const auto high = std::from_chars(low.ptr + 1, end, range[1]);
    if (high.ec == std::errc() && high.ptr == end) return std::optional(range);
  }
  return Error(ErrorCode::kInvalidArgument,
               "--white_range=" + text + " is invalid; expected two times in seconds, as in 0.3,3");
}

Result<AllanResult> Analyse(const AllanOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             OpenRecording(FLAGS_input));
  ProgressLine progress("reading " + FLAGS_input);
  return AnalyseAllan(*source, options, progress.callback());
}

/// What --to names, to be written into the folder of --output.
Result<std::vector<FormatInfo>> ParseNoiseFormats() {
  std::vector<FormatInfo> formats;
  for (const std::string& name : CommaSeparated(FLAGS_to)) {
    if (std::find(kNoiseFormats.begin(), kNoiseFormats.end(), name) == kNoiseFormats.end()) {
      return Error(ErrorCode::kInvalidArgument,
                   "--to: `" + name + "` takes no noise; expected kalibr, openvins or ros2");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(formats.emplace_back(), InfoOfFormat(name));
  }
  if (!formats.empty() && FLAGS_output.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "--to=" + FLAGS_to + " writes a file; name its folder, --output=DIR");
  }
  return formats;
}

/// Names and texts.
using Texts = std::vector<std::pair<std::string, std::string>>;

Result<Texts> TextsOf(const AllanResult& result, const std::vector<FormatInfo>& formats) {
  Texts files = {{"allan.yaml", AllanToYaml(result)}, {"allan.svg", AllanSvg(result)}};
  ExportOptions options;
  options.software_version = Version();
  options.allan = result;
  for (const FormatInfo& format : formats) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Export noise, ExportNoise(format.name, options));
    for (const std::string& warning : noise.warnings) {
      Warn(std::string(format.name) + ": " + warning);
    }
    files.emplace_back(format.file_name, noise.files[0].text);
  }
  return files;
}

/// Writes them, but for their names; their paths.
Result<std::vector<std::string>> WriteTexts(const Texts& texts, WholeFiles* files) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  std::vector<std::string> paths;
  for (const auto& [name, text] : texts) {
    paths.push_back((std::filesystem::path(FLAGS_output) / name).string());
    TRUETRIAD_RETURN_IF_ERROR(files->Write(paths.back(), text));
  }
  return paths;
}

Result<VerbResult> RunAllan(const std::vector<std::string>&) {
  AllanOptions options;
  options.rate_hz = FLAGS_rate_hz;
  TRUETRIAD_ASSIGN_OR_RETURN(const auto range, ParseRange(FLAGS_white_range));
  options.white_range_s = range;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<FormatInfo> formats, ParseNoiseFormats());
  if (!FLAGS_output.empty()) TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const AllanResult result, Analyse(options));
  std::string text = AllanText(result);
  WholeFiles files;
  if (!FLAGS_output.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Texts texts, TextsOf(result, formats));
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> paths, WriteTexts(texts, &files));
    text += "\nResult: " + paths[0] + "\nPlot:   " + paths[1] + "\n";
    for (std::size_t i = 2; i < paths.size(); ++i) text += "Noise:  " + paths[i] + "\n";
  }
  VerbResult said{
      .exit_code = result.at_rest() ? kExitGood : static_cast<int>(ErrorKind::kNotEnough),
      .text = std::move(text),
      .result = ToJson(result)};
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(AllanHtml(result), &said));
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  return said;
}

}  // namespace

Command AllanCommand() {
  return {.name = "allan",
          .summary = "How noisy is each axis at rest, and how stable is its bias?",
          .examples =
              "build/truetriad simulate --config=configs/scenarios/at-rest.yaml "
              "--output=out/at-rest\n"
              "build/truetriad allan --input=out/at-rest/recording.yaml --output=out/allan",
          .details =
              "Computes the overlapping Allan deviation of a log of a unit at rest (an hour or "
              "more) and,\nwith 95 % intervals, noise density N, bias instability B, rate random "
              "walk K and\nquantisation Q. With --output, writes DIR/allan.yaml and DIR/allan.svg; "
              "with --report, a page;\nsee docs/allan.md. --to adds what other programs read, of "
              "the log alone: Kalibr's "
              "imu.yaml, OpenVINS'\nkalibr_imu_chain.yaml, ROS 2 parameters. Exit code 3: a sensor "
              "was not at rest, "
              "and its coefficients are not stated.\n",
          .flags = {{"input", "LOG", true},
                    {"output", "DIR"},
                    {"to", "FORMAT[,FORMAT]", false, {kNoiseFormats.begin(), kNoiseFormats.end()}},
                    {"report", "PAGE.html"},
                    {"rate_hz", "NUMBER"},
                    {"white_range", "LOW,HIGH"}},
          .words = {"input"},
          .run = RunAllan};
}

}  // namespace truetriad
