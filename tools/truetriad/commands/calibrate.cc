// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_bool(report, true, "whether to write the HTML report");
DEFINE_bool(overwrite, false, "replace the results of another unit in the output folder");
DEFINE_string(solver,
              "eliminated",
              "eliminated, or ceres: poses or motion by Ceres as they are, slower, for comparison");

namespace truetriad {
namespace {

/// The same file without the detours that come from paths relative to the experiment.
std::string ShortPath(const std::string& path) {
  const std::string shorter = std::filesystem::path(path).lexically_normal().string();
  std::error_code failure;
  return std::filesystem::equivalent(path, shorter, failure) ? shorter : path;
}

/// --input, one log or several with commas between them; a file whose name has a comma is one.
std::vector<std::string> StatedInputs() {
  std::error_code failure;
  if (std::filesystem::exists(FLAGS_input, failure)) return {FLAGS_input};
  std::vector<std::string> inputs;
  std::istringstream list(FLAGS_input);
  for (std::string input; std::getline(list, input, ',');) inputs.push_back(input);
  return inputs;
}

/// Results of an earlier run, which are not those of this one.
Status PutAside(const std::vector<std::string>& names) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string moved, MoveAside(FLAGS_output, names));
  if (!moved.empty()) std::fprintf(stderr, "%s\n", moved.c_str());
  return {};
}

Status WriteResult(const Calibration& calibration) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  const std::filesystem::path directory = FLAGS_output;
  const std::string file = (directory / "calibration.yaml").string();
  // Both or none: what would fail for the second must stop the first.
  for (const char* name : {"calibration.yaml", "report.html"}) {
    if (std::filesystem::is_directory(directory / name)) {
      return BadInputError((directory / name).string() +
                           ": is a folder; remove it or choose another --output");
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(file, CalibrationToYaml(calibration)));
  std::string written = "\nCalibration: " + file + '\n';
  if (!FLAGS_report) TRUETRIAD_RETURN_IF_ERROR(PutAside({"report.html"}));
  if (FLAGS_report) {
    const std::string page = (directory / "report.html").string();
    TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(page, CalibrationHtml(calibration)));
    written += "Report:      " + page + '\n';
  }
  std::fputs((CalibrationText(calibration) + written).c_str(), stdout);
  return {};
}

Result<Solver> StatedSolver() {
  if (FLAGS_solver == "eliminated") return Solver::kEliminated;
  if (FLAGS_solver == "ceres") return Solver::kCeres;
  return UsageError("--solver=" + FLAGS_solver + " is not known; expected eliminated or ceres");
}

/// The calibration, or why there is none. What another unit's folder holds stays there.
Result<Calibration> CalibrateAsAsked(Solver solver, bool* is_of_another) {
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment, ReadExperiment(FLAGS_config, Overrides()));
  experiment.options.solver = solver;
  if (!FLAGS_input.empty()) experiment.inputs = StatedInputs();
  if (experiment.inputs.empty()) {
    return UsageError("no recording: " + FLAGS_config +
                      " has no `input:`; add it or give --input=LOG");
  }
  if (FLAGS_input.empty()) {
    for (std::string& input : experiment.inputs) input = ShortPath(input);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  const auto check_unit = [&](const std::string& serial) -> Status {
    const Status status = FLAGS_overwrite ? Status() : CheckIsOfUnit(FLAGS_output, serial);
    *is_of_another = !status;
    return status;
  };
  TRUETRIAD_RETURN_IF_ERROR(check_unit(experiment.serial));
  Result<Calibration> calibration = [&] {
    ProgressLine progress("reading " + experiment.inputs.front());
    return CalibrateExperiment(std::move(experiment), progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(calibration);
  TRUETRIAD_RETURN_IF_ERROR(check_unit(calibration->serial));
  TRUETRIAD_RETURN_IF_ERROR(WriteResult(*calibration));
  return calibration;
}

Result<int> RunCalibrate(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Solver solver, StatedSolver());
  bool is_of_another = false;
  const Result<Calibration> calibration = CalibrateAsAsked(solver, &is_of_another);
  if (!calibration) {
    if (!is_of_another) {
      TRUETRIAD_RETURN_IF_ERROR(PutAside({"calibration.yaml", "report.html"}));
    }
    return calibration.error();
  }
  if (!calibration->IsUsable()) return static_cast<int>(ErrorCode::kNotEnough);
  return calibration->within_limits.value_or(true) ? kExitGood : kExitOutsideLimits;
}

}  // namespace

Command CalibrateCommand() {
  return {
      .name = "calibrate",
      .summary = "What are the biases, gains and misalignments of these sensors?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml "
          "--output=out/demo",
      .details =
          "Writes DIR/calibration.yaml and DIR/report.html and prints the result. Several logs are "
          "sessions\nof one unit.\n",
      .flags = {{"config", "EXPERIMENT.yaml", true},
                {"input", "LOG,..."},
                {"output", "DIR", true},
                {"set", "KEY=VALUE,..."},
                {"report", "true|false"},
                {"overwrite", "true|false"},
                {"solver", "eliminated|ceres"}},
      .run = RunCalibrate};
}

}  // namespace truetriad
