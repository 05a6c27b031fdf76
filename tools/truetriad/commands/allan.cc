// SPDX-License-Identifier: Apache-2.0
#include "truetriad/allan/allan.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>

#include <gflags/gflags.h>

#include "allan/allan_file.h"
#include "allan/allan_report.h"
#include "io/whole_file.h"
#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"

DEFINE_double(rate_hz, 0.0, "samples per second, for a log without time");
DEFINE_string(white_range,
              "",
              "tau range in seconds for fitting the noise density, as in 0.3,3 (default: chosen "
              "from the curve)");

namespace truetriad {
namespace {

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

Result<std::string> WriteFiles(const AllanResult& result, WholeFiles* files) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  const std::filesystem::path directory = FLAGS_output;
  const std::string file = (directory / "allan.yaml").string();
  const std::string plot = (directory / "allan.svg").string();
  TRUETRIAD_RETURN_IF_ERROR(files->Write(file, AllanToYaml(result)));
  TRUETRIAD_RETURN_IF_ERROR(files->Write(plot, AllanSvg(result)));
  return "\nResult: " + file + "\nPlot:   " + plot + "\n";
}

Result<VerbResult> RunAllan(const std::vector<std::string>&) {
  AllanOptions options;
  options.rate_hz = FLAGS_rate_hz;
  TRUETRIAD_ASSIGN_OR_RETURN(const auto range, ParseRange(FLAGS_white_range));
  options.white_range_s = range;
  if (!FLAGS_output.empty()) TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const AllanResult result, Analyse(options));
  std::string text = AllanText(result);
  WholeFiles files;
  if (!FLAGS_output.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string written, WriteFiles(result, &files));
    text += written;
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
              "with --report, a page;\nsee docs/allan.md. Exit code 3: a sensor was not at rest, "
              "and its coefficients are not stated.\n",
          .flags = {{"input", "LOG", true},
                    {"output", "DIR"},
                    {"report", "PAGE.html"},
                    {"rate_hz", "NUMBER"},
                    {"white_range", "LOW,HIGH"}},
          .words = {"input"},
          .run = RunAllan};
}

}  // namespace truetriad
