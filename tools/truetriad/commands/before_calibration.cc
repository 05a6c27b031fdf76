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
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "allan/allan_fields.h"
#include "allan/allan_file.h"
#include "allan/allan_report.h"
#include "data/pose_fields.h"
#include "io/calibration_tree.h"
#include "io/pose_program_file.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "planning/plan_fields.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "tree/to_tree.h"
#include "truetriad/allan/allan.h"
#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(program, "", "PROGRAM.yaml: pose program to evaluate; without it, a new one is made");
DEFINE_double(rate_hz, 0.0, "NUMBER: samples per second, for a log without time");
DEFINE_string(white_range,
              "",
              "LOW,HIGH: tau range in seconds for fitting the noise density, as in 0.3,3 (default: "
              "chosen from the curve)");

namespace truetriad {
namespace {

Result<VerbResult> RunInspect(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const PosesConfig config, ParsePoses(FLAGS_poses));
  ProgressLine reading("reading " + FLAGS_input);
  TRUETRIAD_ASSIGN_OR_RETURN(const LoadedPoses loaded,
                             LoadPoses(FLAGS_input, config, reading.callback()));
  ProgressLine calibrating("calibrating " + FLAGS_input);
  const Result<Calibration> tried =
      TryCalibration(FLAGS_input, loaded, config, calibrating.callback());
  // Unreadable files were refused above, so if this calibration fails, there are too few readings.
  const bool is_enough = tried && tried->IsUsable();
  TRUETRIAD_ASSIGN_OR_RETURN(VerbResult result,
                             Said(ReportOf(loaded.poses, tried), ToTree(loaded.poses)));
  result.findings = loaded.poses.findings;
  result.result["usable"] = is_enough;
  if (!is_enough) {
    result.exit_code = kExitNotEnough;
    const Finding refusal = tried ? *FirstRefusal(tried->findings) : RefusalOf(tried.error());
    result.failure = refusal.Message();
    result.findings.push_back(refusal);
  }
  return result;
}

Result<VerbResult> RunInit(const std::vector<std::string>& words) {
  const std::vector<std::string> inputs = StatedInputs(words);
  ProgressLine progress("looking at " + inputs.front());
  const std::string folder = std::filesystem::path(FLAGS_output).parent_path().string();
  TRUETRIAD_ASSIGN_OR_RETURN(const FirstLook look,
                             InitialExperiment(inputs, folder, progress.callback()));
  const std::string& experiment = look.experiment_yaml;
  const Json json = TreeOfYaml(experiment);
  if (FLAGS_output.empty()) return VerbResult{.text = experiment, .result = {{"config", json}}};
  // An existing file may have been edited by the user.
  if (const auto there = ReadSmallFile(FLAGS_output); there && *there != experiment) {
    return Error(ErrorCode::kConflictingArguments,
                 "--output=" + FLAGS_output +
                     " exists and may have been edited; choose another file, or remove it");
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(FLAGS_output, experiment));
  return VerbResult{.text = FLAGS_output + '\n',
                    .result = {{"output", FLAGS_output}, {"config", json}}};
}

Result<VerbResult> RunCheck(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment, ReadExperiment(FLAGS_config, Overrides()));
  // All files that the experiment names, and all of its sensors.
  std::vector<std::string> files = experiment.inputs, sensors;
  for (const std::string* const file : FilesOf(experiment)) files.push_back(*file);
  for (const Triad triad : kTriads) {
    if (experiment.options.triads[triad].enabled) sensors.emplace_back(TriadName(triad));
  }
  for (const std::string& file : files) {
    std::error_code failure;
    if (file.empty() || std::filesystem::exists(file, failure)) continue;
    Note("note: " + std::filesystem::path(file).lexically_normal().string() +
         " does not exist; paths in an experiment are relative to the experiment's folder");
  }
  std::string text = FLAGS_config + ": valid; calibrates ";
  for (const std::string& sensor : sensors) text += (&sensor == &sensors[0] ? "" : ", ") + sensor;
  return VerbResult{.text = text + '\n',
                    .result = {{"config", TreeOfYaml(experiment.resolved_yaml)}}};
}

Result<VerbResult> RunPlan(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment, ReadExperiment(FLAGS_config, Overrides()));
  if (!FLAGS_program.empty()) {
    if (!experiment.plan) experiment.plan = PlanConfig();
    experiment.plan->program = FLAGS_program;
  }
  if (!FLAGS_output.empty()) TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  ProgressLine progress("reading what is measured");
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Plan plan, PlanExperiment(std::move(experiment), FLAGS_input, progress.callback()));
  const VerbReport report = ReportOf(plan);
  std::string text = report.text;
  if (!FLAGS_output.empty()) {
    const std::string program = InOutput("program.yaml"), page = InOutput("program.html");
    TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
    TRUETRIAD_RETURN_IF_ERROR(
        WriteFiles({{program, PoseProgramToYaml(plan.program)}, {page, report.html}}));
    text += "\nProgram:  " + program + "\nPictures: " + page + '\n';
  }
  return VerbResult{.exit_code = plan.IsMet() ? kExitGood : kExitNotEnough,
                    .text = std::move(text),
                    .result = PlanTree(plan),
                    .grade = report.grade};
}

/// Export formats for programs that need a sensor's noise.
constexpr std::array<std::string_view, 3> kNoiseFormats = {"kalibr", "openvins", "ros2"};

/// Parses two numbers, "0.3,3"; unset if the text is empty.
Result<std::optional<std::array<double, 2>>> ParseRange(const std::string& text) {
  if (text.empty()) return std::optional<std::array<double, 2>>();
  const std::vector<std::string> ends = CommaSeparated(text);
  if (ends.size() == 2 && !text.ends_with(',')) {
    const auto low = ParseReal("white_range", ends[0]), high = ParseReal("white_range", ends[1]);
    if (low && high) return std::optional(std::array{*low, *high});
  }
  return BadValue("white_range", text, " is invalid; expected two times in seconds, as in 0.3,3");
}

/// The formats of --to, which need --output. Error (usage): a format is not for noise, or --output
/// is missing.
Result<std::vector<FormatInfo>> ParseNoiseFormats() {
  std::vector<FormatInfo> formats;
  for (const std::string& name : CommaSeparated(FLAGS_to)) {
    if (std::find(kNoiseFormats.begin(), kNoiseFormats.end(), name) == kNoiseFormats.end()) {
      return Error(
          ErrorCode::kInvalidArgument,
          "--to: `" + name + "` is not a format for noise; expected kalibr, openvins or ros2");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(formats.emplace_back(), InfoOfFormat(name));
  }
  if (!formats.empty() && FLAGS_output.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "--to=" + FLAGS_to + " writes a file; name its folder, --output=DIR");
  }
  return formats;
}

/// The paths and texts of the files for the folder of --output.
Result<FileTexts> TextsOf(const AllanResult& result, const std::vector<FormatInfo>& formats) {
  FileTexts files = {{InOutput("allan.yaml"), AllanToYaml(result)},
                     {InOutput("allan.svg"), AllanSvg(result)}};
  ExportOptions options;
  options.software_version = Version();
  options.allan = result;
  for (const FormatInfo& format : formats) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Export noise, ExportNoise(format.name, options));
    for (const std::string& warning : noise.warnings) {
      Warn(std::string(format.name) + ": " + warning);
    }
    files.emplace_back(InOutput(std::string(format.file_name)), noise.files[0].text);
  }
  return files;
}

Result<VerbResult> RunAllan(const std::vector<std::string>&) {
  AllanOptions options;
  options.rate_hz = FLAGS_rate_hz;
  TRUETRIAD_ASSIGN_OR_RETURN(const auto range, ParseRange(FLAGS_white_range));
  options.white_range_s = range;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<FormatInfo> formats, ParseNoiseFormats());
  if (!FLAGS_output.empty()) TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             OpenRecording(FLAGS_input));
  ProgressLine progress("reading " + FLAGS_input);
  TRUETRIAD_ASSIGN_OR_RETURN(const AllanResult result,
                             AnalyseAllan(*source, options, progress.callback()));
  progress.Wipe();
  const VerbReport report = ReportOf(result);
  VerbResult said{.exit_code = result.at_rest() ? kExitGood : kExitNotEnough,
                  .text = report.text,
                  .result = AsInYaml(ToTree(result))};
  FileTexts files;
  if (!FLAGS_output.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(files, TextsOf(result, formats));
    TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
    said.text += "\nResult: " + files[0].first + "\nPlot:   " + files[1].first + "\n";
    for (std::size_t i = 2; i < files.size(); ++i) said.text += "Noise:  " + files[i].first + "\n";
  }
  WholeFiles whole;
  for (const auto& [path, text] : files) TRUETRIAD_RETURN_IF_ERROR(whole.Write(path, text));
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(report.html, &said));
  TRUETRIAD_RETURN_IF_ERROR(whole.Commit());
  return said;
}

}  // namespace

Command InspectCommand() {
  return {.name = "inspect",
          .summary = "What does this log contain, and is it enough to calibrate?",
          .examples = R"(build/truetriad inspect datasets/demo/recording.csv)",
          .details =
              R"(Prints rates, gaps, the poses found, their coverage, the noise within rests and the
temperature range.
)",
          .flags = "input! poses report",
          .words = {"input"},
          .run = RunInspect};
}

Command InitCommand() {
  return {
      .name = "init",
      .summary = "From which experiment can I start for this log?",
      .examples = R"(build/truetriad init datasets/demo/recording.csv > unit.yaml
build/truetriad calibrate -c unit.yaml -o out/unit)",
      .details =
          R"(Prints the experiment that `calibrate LOG` makes for itself, with comments on what to state.
Its paths are relative to the folder of -o, or without -o to the current folder: keep the file there.
)",
      .flags = "input=LOG,...! output=FILE",
      .more_words = "input",
      .run = RunInit};
}

Command CheckCommand() {
  return {
      .name = "check",
      .summary = "Is this experiment valid?",
      .examples = R"(build/truetriad check configs/experiments/joint.yaml)",
      .details =
          R"(Reads the experiment and its presets, but no log. Exit code 2: there are mistakes; each is printed
with its line.
)",
      .flags = "config! set*",
      .words = {"config"},
      .run = RunCheck};
}

Command PlanCommand() {
  return {
      .name = "plan",
      .summary = "Which poses should I take, and how good will the calibration be?",
      .examples = R"(build/truetriad plan --config=configs/plans/joint-12.yaml --output=out/plan)",
      .details =
          R"(EXPERIMENT.yaml has a `plan:` block (docs/planning.md). --input adds poses that are
already measured. Writes DIR/program.yaml, which `simulate` can follow, and
DIR/program.html with a picture of every pose. Exit code 3: some parameters remain
unobservable, or the wanted sigmas are not reached.
)",
      .flags = "config! input program output set*",
      .words = {"config"},
      .run = RunPlan};
}

Command AllanCommand() {
  return {
      .name = "allan",
      .summary = "How noisy is each axis at rest, and how stable is its bias?",
      .examples =
          R"(build/truetriad simulate --config=configs/scenarios/at-rest.yaml --output=out/at-rest
build/truetriad allan --input=out/at-rest/recording.yaml --output=out/allan)",
      .details =
          R"(Computes the overlapping Allan deviation of a log of a unit at rest (an hour or more) and,
with 95 % intervals, noise density N, bias instability B, rate random walk K and
quantisation Q. With --output, writes DIR/allan.yaml and DIR/allan.svg; with --report, a page;
see docs/allan.md. --to adds files for other programs, from this log alone: Kalibr's imu.yaml, OpenVINS'
kalibr_imu_chain.yaml, ROS 2 parameters. Exit code 3: a sensor was not at rest, and its coefficients are not stated.
)",
      .flags = "input! output to=FORMAT[,FORMAT] report rate_hz white_range",
      .values = {{"to", {kNoiseFormats.begin(), kNoiseFormats.end()}}},
      .words = {"input"},
      .run = RunAllan};
}

}  // namespace truetriad
