// SPDX-License-Identifier: Apache-2.0
#include "report/plan.h"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "io/pose_program_file.h"
#include "io/whole_file.h"
#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

DEFINE_string(program, "", "program.yaml to evaluate instead of making a new one");

namespace truetriad {
namespace {

Result<std::string> WriteResult(const Plan& plan) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  const std::filesystem::path directory = FLAGS_output;
  const std::string program = (directory / "program.yaml").string();
  const std::string page = (directory / "program.html").string();
  WholeFiles files;
  TRUETRIAD_RETURN_IF_ERROR(files.Write(program, PoseProgramToYaml(plan.program)));
  TRUETRIAD_RETURN_IF_ERROR(files.Write(page, PlanHtml(plan)));
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  return "\nProgram:  " + program + "\nPictures: " + page + '\n';
}

Result<VerbResult> RunPlan(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(Experiment experiment, ReadExperiment(FLAGS_config, Overrides()));
  if (!FLAGS_program.empty()) {
    if (!experiment.plan) experiment.plan = PlanConfig();
    experiment.plan->program = FLAGS_program;
  }
  std::string measured = FLAGS_input;
  if (measured.empty() && experiment.plan && experiment.plan->from_recording) {
    if (experiment.inputs.size() > 1) {
      return Error(ErrorCode::kConflictingArguments,
                   {FLAGS_config},
                   "`start: recording` takes one recording; give it as --input=LOG");
    }
    if (experiment.inputs.size() == 1) measured = experiment.inputs.front();
    if (measured.empty()) {
      return Error(ErrorCode::kMissingArgument,
                   {FLAGS_config},
                   "`start: recording` needs a recording; add `input:` or give --input=LOG");
    }
  }
  if (!FLAGS_output.empty()) TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(FLAGS_output));
  const Result<Plan> plan = [&] {
    ProgressLine progress("reading " + measured);
    return PlanExperiment(std::move(experiment), measured, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(plan);
  std::string text = PlanText(*plan);
  if (!FLAGS_output.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string written, WriteResult(*plan));
    text += written;
  }
  return VerbResult{
      .exit_code = plan->IsMet() ? kExitGood : static_cast<int>(ErrorKind::kNotEnough),
      .text = std::move(text),
      .result = ToJson(*plan),
      .grade = GradeOf(*plan)};
}

}  // namespace

Command PlanCommand() {
  return {.name = "plan",
          .summary = "Which poses should I take, and how good will the calibration be?",
          .examples = "build/truetriad plan --config=configs/plans/joint-12.yaml --output=out/plan",
          .details =
              "EXPERIMENT.yaml has a `plan:` block (docs/planning.md). --input adds poses that "
              "are\nalready measured. Writes DIR/program.yaml, which `simulate` can follow, "
              "and\nDIR/program.html with a picture of every pose. Exit code 3: some parameters "
              "remain\nunobservable, or the wanted sigmas are not reached.\n",
          .flags = {{"config", "EXPERIMENT.yaml", true},
                    {"input", "LOG"},
                    {"program", "PROGRAM.yaml"},
                    {"output", "DIR"},
                    {"set", "KEY=VALUE,...", false, {}, true}},
          .words = {"config"},
          .run = RunPlan};
}

}  // namespace truetriad
