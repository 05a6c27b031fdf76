// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "base/messages.h"
#include "report/content.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/interruption.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/corrected_log.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// Where what was written has not the size of the field it should show: a wrong unit in the log's
/// header, or another unit's calibration. Whatever the unit does, on the whole it feels gravity.
void TellOddLength(const CorrectedLogSummary& summary, const Calibration& calibration) {
  constexpr double kOdd = 3.0;
  const auto tell = [&](Triad triad, double expected, const char* field) {
    const double length = summary.mean_length[triad];
    if (!(length > 0.0) || (length < kOdd * expected && length * kOdd > expected)) return;
    Warn("the corrected " + std::string(TriadName(triad)) + Format(" reads %.3g ", length) +
         std::string(TruthUnitName(triad)) +
         Format(" in the mean, %.3g times ", length / expected) + field +
         ": check the unit that the log states, and whose calibration this is");
  };
  tell(Triad::kAccelerometer, calibration.reference.gravity_mps2, "gravity");
  if (calibration.reference.field_ut) {
    tell(Triad::kMagnetometer, *calibration.reference.field_ut, "the field it was calibrated in");
  }
}

/// What a user must know about the rows, on stderr: stdout may be the log itself.
void Tell(const CorrectedLogSummary& summary) {
  Note(std::to_string(summary.rows) + " rows written");
  for (const Triad triad : summary.left_out) {
    Note(std::string(TriadName(triad)) + " skipped: the calibration does not include it");
  }
  if (summary.clamped_temperature > 0) {
    Note(std::to_string(summary.clamped_temperature) +
         " rows outside the calibrated temperature range: corrected as at its nearest end");
  }
  if (summary.not_corrected > 0) {
    Note(std::to_string(summary.not_corrected) +
         " rows with a sensor left empty: no temperature or force was available yet");
  }
}

// The output is renamed into its place: it must not be a device or a link.
Status CheckOutput() {
  std::error_code none;
  const std::filesystem::path output = FLAGS_output;
  if (!std::filesystem::exists(output, none)) return {};
  if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(output, none))) {
    return Error(ErrorCode::kConflictingArguments,
                 "--output=" + FLAGS_output + " exists and is not a regular file");
  }
  return {};
}

Result<VerbResult> RunApply(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration, ReadCalibration(FLAGS_calibration));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             OpenRecording(FLAGS_input));
  TRUETRIAD_RETURN_IF_ERROR(
      CheckSameUnit(FLAGS_input + ": the recording", source->info().serial, calibration));
  TRUETRIAD_RETURN_IF_ERROR(CheckOutput());
  if (calibration.verdict() == Verdict::kFail) {
    Warn(FLAGS_calibration + ": " + HeadlineOf(calibration).text +
         "; its readings are corrected all the same");
  }
  NoteInterruptions();
  const Result<CorrectedLogSummary> summary = [&] {
    ProgressLine progress("correcting " + FLAGS_input);
    return WriteCorrectedLog(
        *source, calibration, FLAGS_output, progress.callback(), IsInterrupted);
  }();
  EndAsInterrupted();
  TRUETRIAD_RETURN_IF_ERROR(summary);
  Tell(*summary);
  TellOddLength(*summary, calibration);
  VerbResult result;
  result.result = {{"output", FLAGS_output},
                   {"rows", summary->rows},
                   {"clamped_temperature", summary->clamped_temperature},
                   {"not_corrected", summary->not_corrected},
                   {"left_out", Json::array()}};
  for (const Triad triad : summary->left_out) {
    result.result["left_out"].push_back(TriadName(triad));
  }
  return result;
}

}  // namespace

Command ApplyCommand() {
  return {
      .name = "apply",
      .summary = "What would a perfect sensor have read?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo\n"
          "build/truetriad apply --calibration=out/demo/calibration.yaml "
          "--input=datasets/demo/recording.csv --output=out/demo/corrected.csv",
      .details =
          "Writes a self-describing CSV in m/s^2, rad/s and uT with the sensors that the "
          "calibration\nincludes.\n",
      .flags = {{"calibration", "FILE", true}, {"input", "LOG", true}, {"output", "CSV", true}},
      .words = {"calibration", "input"},
      .run = RunApply};
}

}  // namespace truetriad
