// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "allan/allan_file.h"
#include "allan/allan_report.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "json/plain_yaml.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/plot_script.h"
#include "tools/truetriad/progress.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_bool(overwrite, false, "replace the results of another unit in the output folder");
DEFINE_string(solver,
              "eliminated",
              "eliminated, or ceres: poses or motion by Ceres as they are, slower, for comparison");

namespace truetriad {
namespace {

constexpr std::array<const char*, 3> kResults = {
    "calibration.yaml", "calibration.json", "report.html"};

/// The same file without the detours that come from paths relative to the experiment.
std::string ShortPath(const std::string& path) {
  const std::string shorter = std::filesystem::path(path).lexically_normal().string();
  std::error_code failure;
  return std::filesystem::equivalent(path, shorter, failure) ? shorter : path;
}

/// What is to be done.
struct Task {
  Experiment experiment;
  std::string folder;
  std::string initial_yaml;  // the experiment, where none was given
  std::optional<LoadedPoses> first;
  bool has_report = true;
};

/// What is there stays beside the new result: a result without parameters takes the place of none
/// that has them, and one that names no unit of none that names one.
bool StaysBeside(const Calibration& by, const std::string& folder) {
  if (by.IsUsable() && (FLAGS_overwrite || !by.serial.empty())) return false;
  const std::string file = (std::filesystem::path(folder) / "calibration.yaml").string();
  const Result<std::string> text = LookAtSmallFile(file);
  if (!text) return false;
  const Result<Calibration> there = CalibrationFromYaml(*text, file);
  return there && there->IsUsable() && !(by.IsUsable() && there->serial.empty());
}

/// Of each sensor whose noise is taken from an Allan deviation.
std::vector<Drawing> AllanDrawings(const Task& task) {
  std::vector<Drawing> drawings;
  for (const Triad triad : kTriads) {
    const std::string& file = task.experiment.allan_files[triad];
    if (file.empty() || !task.experiment.options.triads[triad].enabled) continue;
    Result<AllanResult> allan = ReadAllanFile(file);
    if (!allan) continue;  // It was read before, or the calibration has not come as far.
    std::erase_if(allan->triads, [&](const AllanTriad& other) { return other.triad != triad; });
    drawings.push_back(AllanDrawing(*allan));
  }
  return drawings;
}

/// Which files they are, for people.
Result<std::string> WriteResult(const Task& task,
                                const Calibration& calibration,
                                const PoseSet& poses,
                                const std::string& yaml,
                                const Json& json) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(task.folder));
  const std::filesystem::path directory = task.folder;
  std::vector<std::string> aside;
  if (StaysBeside(calibration, task.folder)) aside = {kResults.begin(), kResults.end()};
  WholeFiles files;
  std::string written;
  if (!task.initial_yaml.empty()) {
    const std::string& path = task.experiment.path;
    const Result<std::string> there = LookAtSmallFile(path);
    // Somebody may have written into that of an earlier run.
    if (!there || *there != task.initial_yaml) aside.emplace_back("experiment.yaml");
    TRUETRIAD_RETURN_IF_ERROR(files.Write(path, task.initial_yaml));
    written = "Experiment:  " + path + '\n';
  }
  // The result comes last: where it is, what it goes with is there, too.
  std::string report;
  if (task.has_report) {
    const std::string page = (directory / "report.html").string();
    TRUETRIAD_RETURN_IF_ERROR(files.Write(
        page,
        CalibrationHtml(
            calibration, StatedLooks(), {.poses = &poses, .noise = AllanDrawings(task)})));
    report = "Report:      " + page + '\n';
  } else {
    aside.emplace_back("report.html");
  }
  const std::string file = (directory / "calibration.yaml").string();
  TRUETRIAD_RETURN_IF_ERROR(files.Write((directory / "calibration.json").string(), TextOf(json)));
  TRUETRIAD_RETURN_IF_ERROR(files.Write(file, yaml));
  TRUETRIAD_RETURN_IF_ERROR(MoveAside(directory, aside));
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  return "\n" + written + "Calibration: " + file + '\n' + report;
}

Result<Solver> StatedSolver() {
  if (FLAGS_solver == "eliminated") return Solver::kEliminated;
  if (FLAGS_solver == "ceres") return Solver::kCeres;
  return Error(ErrorCode::kInvalidArgument,
               "--solver=" + FLAGS_solver + " is not known; expected eliminated or ceres");
}

Result<bool> StatedReport() {
  if (FLAGS_report.empty() || FLAGS_report == "true") return true;
  if (FLAGS_report == "false") return false;
  return Error(ErrorCode::kInvalidArgument,
               "--report=" + FLAGS_report +
                   " is invalid; expected true or false (--output names the folder)");
}

std::string FolderFor(const std::vector<std::string>& inputs) {
  return FLAGS_output.empty() ? inputs.front() + ".truetriad" : FLAGS_output;
}

/// Without an experiment: one for what is in the logs.
Result<Task> InitialTask(const std::vector<std::string>& inputs) {
  if (inputs.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "no log; name one (`truetriad calibrate LOG.csv`), or an experiment (--config=…)");
  }
  Task task;
  task.folder = FolderFor(inputs);
  ProgressLine progress("looking at " + inputs.front());
  TRUETRIAD_ASSIGN_OR_RETURN(FirstLook look,
                             InitialExperiment(inputs, task.folder, progress.callback()));
  task.initial_yaml = std::move(look.experiment_yaml);
  task.first = std::move(look.loaded);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> overrides, OverridesAndTags());
  for (const std::string& item : overrides) task.initial_yaml += "# --set=" + item + '\n';
  const std::string path = (std::filesystem::path(task.folder) / "experiment.yaml").string();
  TRUETRIAD_ASSIGN_OR_RETURN(task.experiment,
                             ReadExperimentText(task.initial_yaml, "experiment.yaml", overrides));
  // Paths in overrides are as seen from here: no file of the user's states them.
  task.experiment.path = path;
  task.experiment.inputs = inputs;
  return task;
}

Result<Task> TaskFor(const std::vector<std::string>& inputs) {
  if (FLAGS_config.empty()) return InitialTask(inputs);
  Task task;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> overrides, OverridesAndTags());
  TRUETRIAD_ASSIGN_OR_RETURN(task.experiment, ReadExperiment(FLAGS_config, overrides));
  if (inputs.empty()) {
    for (std::string& input : task.experiment.inputs) input = ShortPath(input);
  } else {
    task.experiment.inputs = inputs;
  }
  if (task.experiment.inputs.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "no recording: " + FLAGS_config + " has no `input:`; add it or give --input=LOG");
  }
  task.folder = FolderFor(task.experiment.inputs);
  return task;
}

Result<VerbResult> RunCalibrate(const std::vector<std::string>& words) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Solver solver, StatedSolver());
  TRUETRIAD_ASSIGN_OR_RETURN(const bool has_report, StatedReport());
  TRUETRIAD_ASSIGN_OR_RETURN(Task task, TaskFor(StatedInputs(words)));
  task.experiment.options.solver = solver;
  task.has_report = has_report;
  TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(task.folder));
  const auto check_unit = [&](const std::string& serial) {
    return FLAGS_overwrite ? Status() : CheckIsOfUnit(task.folder, serial);
  };
  TRUETRIAD_RETURN_IF_ERROR(check_unit(task.experiment.serial));
  PoseSet poses;
  const Result<Calibration> calibration = [&] {
    ProgressLine progress("reading " + task.experiment.inputs.front());
    return CalibrateExperiment(task.experiment, progress.callback(), std::move(task.first), &poses);
  }();
  TRUETRIAD_RETURN_IF_ERROR(calibration);
  TRUETRIAD_RETURN_IF_ERROR(check_unit(calibration->serial));
  const std::string yaml = CalibrationToYaml(*calibration);
  Json json = JsonOfPlainYaml(yaml);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string written,
                             WriteResult(task, *calibration, poses, yaml, json));
  VerbResult result{.text = CalibrationText(*calibration) + written, .result = std::move(json)};
  result.findings = calibration->findings;
  result.outcome = calibration->outcome;
  result.grade = GradeOf(*calibration);
  if (!calibration->IsUsable()) {
    result.exit_code = static_cast<int>(ErrorKind::kNotEnough);
  } else if (!calibration->within_limits.value_or(true)) {
    result.exit_code = kExitOutsideLimits;
  }
  return result;
}

}  // namespace

Command CalibrateCommand() {
  return {
      .name = "calibrate",
      .summary = "What are the biases, gains and misalignments of these sensors?",
      .examples =
          "build/truetriad calibrate datasets/demo/recording.csv -o out/first\n"
          "build/truetriad calibrate -c configs/experiments/joint.yaml -o out/demo",
      .details =
          "Writes DIR/calibration.yaml, the same as DIR/calibration.json, and DIR/report.html, and "
          "prints the\nresult. Without -c it calibrates every sensor in the log with defaults, and "
          "writes\nDIR/experiment.yaml, too; without -o, DIR is LOG.truetriad. Several logs are "
          "sessions of one unit.\n",
      .flags = {{"config", "EXPERIMENT.yaml"},
                {"input", "LOG,..."},
                {"output", "DIR"},
                {"set", "KEY=VALUE,...", false, {}, true},
                {"tag", "KEY=VALUE", false, {}, true},
                {"report", "true|false", false, {"true", "false"}},
                {"interactive", "true|false", false, {"true", "false"}},
                {"overwrite", "true|false"},
                {"solver", "eliminated|ceres"}},
      .more_words = "input",
      .run = RunCalibrate};
}

}  // namespace truetriad
