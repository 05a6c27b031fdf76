// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/progress.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

Result<int> RunInspect(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const PosesConfig config, ParsePoses(FLAGS_poses));
  const Result<LoadedPoses> loaded = [&] {
    ProgressLine progress("reading " + FLAGS_input);
    return LoadPoses(FLAGS_input, config, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(loaded);
  std::fputs(InspectionText(loaded->poses).c_str(), stdout);
  if (loaded->not_enough) return *loaded->not_enough;
  return kExitGood;
}

}  // namespace

Command InspectCommand() {
  return {.name = "inspect",
          .summary = "What does this log contain, and is it enough to calibrate?",
          .examples = "build/truetriad inspect datasets/demo/recording.csv",
          .details =
              "Prints rates, gaps, the poses found, their coverage, the noise within rests and "
              "the\ntemperature range.\n",
          .flags = {{"input", "LOG", true}, {"poses", "HOW"}},
          .words = {"input"},
          .run = RunInspect};
}

}  // namespace truetriad
