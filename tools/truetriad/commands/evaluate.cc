// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/pipeline.h"
#include "tools/truetriad/progress.h"
#include "truetriad/estimation/calibrate.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

Result<int> Run(const std::vector<std::string>&) {
  Result<PosesConfig> config = ParsePoses(FLAGS_poses);
  TRUETRIAD_RETURN_IF_ERROR(config);
  const Result<Calibration> calibration = ReadCalibration(FLAGS_calibration);
  TRUETRIAD_RETURN_IF_ERROR(calibration);
  config->moves = calibration->sensors[Triad::kGyroscope].has_value();
  const Result<LoadedPoses> loaded = [&] {
    ProgressLine progress("reading " + FLAGS_input);
    return LoadPoses(FLAGS_input, *config, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(loaded);
  if (loaded->not_enough) return *loaded->not_enough;
  const Result<EvaluationSummary> evaluation = Evaluate(*calibration, loaded->poses);
  TRUETRIAD_RETURN_IF_ERROR(evaluation);
  std::fputs(EvaluationText(*evaluation, *calibration).c_str(), stdout);
  return kExitGood;
}

}  // namespace

Command EvaluateCommand() {
  return {
      .name = "evaluate",
      .summary = "How good is this calibration on data that it has not seen?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo\n"
          "build/truetriad evaluate --calibration=out/demo/calibration.yaml "
          "--input=datasets/demo/recording.csv",
      .details = "On the recording that made the calibration, as here, the answer flatters.\n",
      .flags = {{"calibration", "FILE", true}, {"input", "LOG", true}, {"poses", "HOW"}},
      .run = Run};
}

}  // namespace truetriad
