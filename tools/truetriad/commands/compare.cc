// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <gflags/gflags.h>

#include "base/messages.h"
#include "calibrate/verdict_fields.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "tree/to_tree.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(a, "", "FILE: one calibration.yaml");
DEFINE_string(b, "", "FILE: the calibration.yaml to compare it with");

namespace truetriad {
namespace {

constexpr char kWorse[] = "worse";

/// Whether a file states that it is a calibration.yaml of any version.
bool IsCalibration(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  // The first key, after some comments, states the format.
  constexpr std::size_t kHeadBytes = 4096;
  std::string head(kHeadBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return ("\n" + head).find("\nformat: truetriad/calibration/") != std::string::npos;
}

/// Tells calibrations from logs by contents, whatever the order of the files. If two files are not
/// one of each, the first is treated as the calibration, so that a reader reports what is wrong.
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

Result<LoadedPoses> LoadFor(const std::vector<Calibration>& calibrations, const std::string& log) {
  ProgressLine progress("reading " + log);
  Result<LoadedPoses> loaded = LoadToEvaluate(calibrations, log, FLAGS_poses, progress.callback());
  for (const Triad triad : kTriads) {
    const double offset_s = loaded ? loaded->config.time_offset_s[triad] : 0.0;
    if (offset_s == 0.0) continue;
    Note(std::string(TriadName(triad)) +
         Formatted(": %g s subtracted from its times, as in the calibration", offset_s));
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
  return Said(ReportOf(evaluation, calibration, about),
              ToTree(evaluation),
              has_failed ? kExitOutsideLimits : kExitGood);
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
  return Said(ReportOf(both, about),
              ToTree(both),
              FLAGS_fail_on == kWorse && may_be_worse ? kExitOutsideLimits : kExitGood);
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

constexpr char kDiffer[] = "differ";
constexpr char kSameReadings[] =
    "Both were made from the same readings, so they share the noise and agree better than "
    "calibrations from two recordings would.";

Result<VerbResult> RunCompare(const std::vector<std::string>&) {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kDiffer));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration a, ReadCalibration(FLAGS_a));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration b, ReadCalibration(FLAGS_b));
  TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors(FLAGS_a, a, b));
  TRUETRIAD_ASSIGN_OR_RETURN(const Comparison comparison, Compare(a, b));
  std::vector<std::string> about = {"a: " + OriginOf(FLAGS_a, a), "b: " + OriginOf(FLAGS_b, b)};
  if (IsMadeFrom(a, b.inputs) || IsTooAlike(comparison)) {
    about.emplace_back(kSameReadings);
    Note("note: " + std::string(kSameReadings));
  }
  const bool has_failed = FLAGS_fail_on == kDiffer && AgreementOf(comparison) != Agreement::kAgree;
  return Said(
      ReportOf(comparison, about), ToTree(comparison), has_failed ? kExitOutsideLimits : kExitGood);
}

}  // namespace

Command EvaluateCommand() {
  return {.name = "evaluate",
          .summary = "How good is this calibration on data it has not seen?",
          .examples =
              R"(build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo
build/truetriad evaluate --calibration=out/demo/calibration.yaml --input=datasets/demo/recording.csv)",
          .details =
              R"(Use a separate recording: if the calibration was made from this one (as in this
example), the result says that this is no test. With --fail-on=worse, exit code 4 says that the errors
are not as predicted, or that they could not be judged.

`truetriad evaluate A.yaml B.yaml LOG` compares two calibrations, such as a new one and that of the
vehicle (`import`): which has smaller errors, and by what factor. With --fail-on=worse, exit code 4 says
that an error of A is larger, that nothing could be compared, or that A was made from this recording.
)",
          .flags = "calibration! input! poses fail-on=worse report",
          .words = {"calibration", "input"},
          .more_words = "another-file",
          .run = RunEvaluate};
}

Command CompareCommand() {
  return {
      .name = "compare",
      .summary = "Do two calibrations of one unit agree, in sigmas?",
      .examples =
          R"(build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/a
build/truetriad calibrate --config=configs/experiments/accelerometer-only.yaml --output=out/b
build/truetriad compare --a=out/a/calibration.yaml --b=out/b/calibration.yaml)",
      .details =
          R"(The body frames are aligned first, so the frame conventions may differ. If different sensors define the
frames, only biases and C^T C are compared, which do not depend on the frame. The two calibrations are
assumed to be independent. With --fail-on=differ, exit code 4 says that they do not agree, or that
nothing could be compared.
)",
      .flags = "a! b! fail-on=differ report",
      .words = {"a", "b"},
      .run = RunCompare};
}

}  // namespace truetriad
