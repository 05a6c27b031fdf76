// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/evaluate.h"

#include <array>
#include <cstdio>
#include <string>

#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/calibrate/evaluate.h"
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

Result<VerbResult> RunEvaluate(const std::vector<std::string>&) {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kWorse));
  TRUETRIAD_ASSIGN_OR_RETURN(PosesConfig config, ParsePoses(FLAGS_poses));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration, ReadCalibration(FLAGS_calibration));
  TakeClocks(calibration, &config);
  config.moves = calibration.sensors[Triad::kGyroscope].has_value();
  const Result<LoadedPoses> loaded = [&] {
    ProgressLine progress("reading " + FLAGS_input);
    return LoadPoses(FLAGS_input, config, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(loaded);
  if (loaded->not_enough) return *loaded->not_enough;
  TRUETRIAD_RETURN_IF_ERROR(
      CheckSameUnit(FLAGS_input + ": the recording", loaded->poses.serial, calibration));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const EvaluationSummary evaluation,
      Evaluate(calibration, loaded->poses, IsMadeFrom(calibration, loaded->inputs)));
  const std::vector<std::string> about = {
      "Calibration: " + OriginOf(FLAGS_calibration, calibration), "Recording: " + FLAGS_input};
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
          "errors are not\nthose predicted, or that nothing could be said.\n",
      .flags = {{"calibration", "FILE", true},
                {"input", "LOG", true},
                {"poses", "HOW"},
                {"fail-on", "worse", false, {kWorse}},
                {"report", "PAGE.html"}},
      .words = {"calibration", "input"},
      .run = RunEvaluate};
}

}  // namespace truetriad
