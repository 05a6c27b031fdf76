// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/evaluate.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "base/messages.h"
#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/calibrate/side_by_side.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

constexpr char kWorse[] = "worse";

/// Clocks are those of the unit: what was taken off the times that it was calibrated from is taken
/// off these as well.
void TakeClocks(const Calibration& calibration, PosesConfig* config) {
  config->time_offset_s = TimeOffsetsOf(calibration);
  config->time_stamps = TimeStampsOf(calibration);
  for (const Triad triad : kTriads) {
    const double offset_s = config->time_offset_s[triad];
    if (offset_s == 0.0) continue;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), ": %g s subtracted from its times", offset_s);
    Note(std::string(TriadName(triad)) + text.data() + ", as in the calibration");
  }
}

/// Whether a file says that it is a calibration.yaml, of whatever version.
bool IsCalibration(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  // It says so in its first key, behind some comments.
  constexpr std::size_t kHeadBytes = 4096;
  std::string head(kHeadBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return ("\n" + head).find("\nformat: truetriad/calibration/") != std::string::npos;
}

/// Files by what is in them, in whatever order they were named. One calibration that is not said to
/// be one is the first word, whose reader then says what is wrong with it.
Status SortFiles(const std::vector<std::string>& words,
                 std::vector<std::string>* calibrations,
                 std::string* log) {
  std::vector<std::string> files = {FLAGS_calibration, FLAGS_input}, logs;
  files.insert(files.end(), words.begin(), words.end());
  for (const std::string& file : files) {
    (IsCalibration(file) ? *calibrations : logs).push_back(file);
  }
  if (files.size() == 2 && (logs.size() != 1)) {
    *calibrations = {files[0]};
    logs = {files[1]};
  }
  if (logs.size() != 1 || calibrations->size() > 2) {
    return Error(ErrorCode::kConflictingArguments,
                 "these are " + Counted(static_cast<int>(calibrations->size()), "calibration") +
                     " and " + Counted(static_cast<int>(logs.size()), "recording") +
                     "; expected one or two calibrations and one recording");
  }
  *log = logs[0];
  return {};
}

/// Both clocks and the times of turns are those that the first calibration states.
Result<LoadedPoses> LoadFor(const std::vector<Calibration>& calibrations, const std::string& log) {
  TRUETRIAD_ASSIGN_OR_RETURN(PosesConfig config, ParsePoses(FLAGS_poses));
  TakeClocks(calibrations.front(), &config);
  config.moves = std::any_of(calibrations.begin(), calibrations.end(), [](const Calibration& each) {
    return each.sensors[Triad::kGyroscope].has_value();
  });
  TRUETRIAD_ASSIGN_OR_RETURN(LoadedPoses loaded, [&] {
    ProgressLine progress("reading " + log);
    return LoadPoses(log, config, progress.callback());
  }());
  if (loaded.not_enough) return *loaded.not_enough;
  for (const Calibration& calibration : calibrations) {
    TRUETRIAD_RETURN_IF_ERROR(
        CheckSameUnit(log + ": the recording", loaded.poses.serial, calibration));
  }
  return loaded;
}

Result<VerbResult> EvaluateOne(const std::string& file,
                               const Calibration& calibration,
                               const std::string& log) {
  TRUETRIAD_ASSIGN_OR_RETURN(const LoadedPoses loaded, LoadFor({calibration}, log));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const EvaluationSummary evaluation,
      Evaluate(
          calibration, loaded.poses, IsMadeFrom(calibration, loaded.inputs), loaded.si_per_count));
  const std::vector<std::string> about = {"Calibration: " + OriginOf(file, calibration),
                                          "Recording: " + log};
  const bool has_failed =
      FLAGS_fail_on == kWorse && VerdictOf(evaluation) != PredictionVerdict::kAsPredicted;
  VerbResult result{.exit_code = has_failed ? kExitOutsideLimits : kExitGood,
                    .text = EvaluationText(evaluation, calibration, about),
                    .result = ToJson(evaluation),
                    .grade = GradeOf(evaluation, calibration)};
  TRUETRIAD_RETURN_IF_ERROR(
      WriteStatedReport(EvaluationHtml(evaluation, calibration, about), &result));
  return result;
}

Result<VerbResult> EvaluateTwo(const std::vector<std::string>& files,
                               const Calibration& a,
                               const Calibration& b,
                               const std::string& log) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors(files[0], a, b));
  TRUETRIAD_ASSIGN_OR_RETURN(const LoadedPoses loaded, LoadFor({a, b}, log));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const SideBySide both,
      EvaluateSideBySide(a,
                         b,
                         loaded.poses,
                         {IsMadeFrom(a, loaded.inputs), IsMadeFrom(b, loaded.inputs)},
                         loaded.si_per_count));
  const std::vector<std::string> about = {
      "A: " + OriginOf(files[0], a), "B: " + OriginOf(files[1], b), "Recording: " + log};
  const Better better = BetterOf(both);
  const bool may_be_worse =
      better == Better::kB || better == Better::kMixed || both.errors.empty() || both.a.is_own;
  VerbResult result{
      .exit_code = FLAGS_fail_on == kWorse && may_be_worse ? kExitOutsideLimits : kExitGood,
      .text = SideBySideText(both, about),
      .result = ToJson(both),
      .grade = GradeOf(both)};
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(SideBySideHtml(both, about), &result));
  return result;
}

Result<VerbResult> RunEvaluate(const std::vector<std::string>& words) {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kWorse));
  std::vector<std::string> files;
  std::string log;
  TRUETRIAD_RETURN_IF_ERROR(SortFiles(words, &files, &log));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration a, ReadCalibration(files[0]));
  if (files.size() == 1) return EvaluateOne(files[0], a, log);
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration b, ReadCalibration(files[1]));
  return EvaluateTwo(files, a, b, log);
}

}  // namespace

Command EvaluateCommand() {
  return {
      .name = "evaluate",
      .summary = "How good is this calibration on data it has not seen?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo\n"
          "build/truetriad evaluate --calibration=out/demo/calibration.yaml "
          "--input=datasets/demo/recording.csv",
      .details =
          "Use a separate recording: of the one that the calibration was made from (as in "
          "this\nexample) it says that this is no test. With --fail-on=worse exit code 4 says that "
          "the "
          "errors are not\nthose predicted, or that nothing could be said.\n\n`truetriad evaluate "
          "A.yaml B.yaml LOG` has two calibrations side by side, a new one and what the vehicle\n"
          "carries (`import`): whose errors are smaller, and how many times. With --fail-on=worse "
          "exit code 4 says\nthat one of A's is larger, or that A was made from this recording.\n",
      .flags = {{"calibration", "FILE", true},
                {"input", "LOG", true},
                {"poses", "HOW"},
                {"fail-on", "worse", false, {kWorse}},
                {"report", "PAGE.html"}},
      .words = {"calibration", "input"},
      .more_words = "another-file",
      .run = RunEvaluate};
}

}  // namespace truetriad
