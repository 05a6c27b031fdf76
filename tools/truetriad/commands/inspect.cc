// SPDX-License-Identifier: Apache-2.0
#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

Result<VerbResult> RunInspect(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const PosesConfig config, ParsePoses(FLAGS_poses));
  Result<LoadedPoses> loaded = [&] {
    ProgressLine progress("reading " + FLAGS_input);
    return LoadPoses(FLAGS_input, config, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(loaded);
  const Result<Calibration> tried = [&] {
    ProgressLine progress("calibrating " + FLAGS_input);
    return TryCalibration(FLAGS_input, *loaded, config, progress.callback());
  }();
  // What cannot be read was refused above: here something is missing.
  const bool is_enough = tried && tried->IsUsable();
  VerbResult result{.text = InspectionText(loaded->poses, tried), .result = ToJson(loaded->poses)};
  result.findings = loaded->poses.findings;
  result.grade = InspectionGrade(tried);
  result.result["usable"] = is_enough;
  if (!is_enough) {
    result.exit_code = static_cast<int>(ErrorKind::kNotEnough);
    const Finding refusal = tried ? *FirstRefusal(tried->findings) : RefusalOf(tried.error());
    result.failure = refusal.Message();
    result.findings.push_back(refusal);
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(InspectionHtml(loaded->poses, tried), &result));
  return result;
}

}  // namespace

Command InspectCommand() {
  return {.name = "inspect",
          .summary = "What does this log contain, and is it enough to calibrate?",
          .examples = "build/truetriad inspect datasets/demo/recording.csv",
          .details =
              "Prints rates, gaps, the poses found, their coverage, the noise within rests and "
              "the\ntemperature range.\n",
          .flags = {{"input", "LOG", true}, {"poses", "HOW"}, {"report", "PAGE.html"}},
          .words = {"input"},
          .run = RunInspect};
}

}  // namespace truetriad
