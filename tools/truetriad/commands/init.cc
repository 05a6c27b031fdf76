// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include "io/yaml_reader.h"
#include "json/plain_yaml.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/progress.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

Result<VerbResult> RunInit(const std::vector<std::string>& words) {
  const std::vector<std::string> inputs = StatedInputs(words);
  const Result<FirstLook> look = [&] {
    ProgressLine progress("looking at " + inputs.front());
    const std::string folder = std::filesystem::path(FLAGS_output).parent_path().string();
    return InitialExperiment(inputs, folder, progress.callback());
  }();
  TRUETRIAD_RETURN_IF_ERROR(look);
  const std::string& experiment = look->experiment_yaml;
  if (!FLAGS_output.empty()) {
    // People write into it.
    if (const auto there = ReadSmallFile(FLAGS_output); there && *there != experiment) {
      return Error(ErrorCode::kConflictingArguments,
                   "--output=" + FLAGS_output +
                       " exists and may have been edited; choose another file, or remove it");
    }
    TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(FLAGS_output, experiment));
    return VerbResult{
        .text = FLAGS_output + '\n',
        .result = {{"output", FLAGS_output}, {"config", JsonOfPlainYaml(experiment)}}};
  }
  return VerbResult{.text = experiment, .result = {{"config", JsonOfPlainYaml(experiment)}}};
}

}  // namespace

Command InitCommand() {
  return {
      .name = "init",
      .summary = "How does an experiment for this log begin?",
      .examples =
          "build/truetriad init datasets/demo/recording.csv > unit.yaml\n"
          "build/truetriad calibrate -c unit.yaml -o out/unit",
      .details =
          "Prints the experiment that `calibrate LOG` makes for itself, with comments on what "
          "to state.\nPaths in it are as seen from the folder of -o, or from the current one: keep "
          "it there.\n",
      .flags = {{"input", "LOG,...", true}, {"output", "FILE"}},
      .more_words = "input",
      .run = RunInit};
}

}  // namespace truetriad
