// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "json/plain_yaml.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace {

// "accelerometer, gyroscope"
std::string SensorsOf(const Experiment& experiment) {
  std::string names;
  for (const Triad triad : kTriads) {
    if (!experiment.options.triads[triad].enabled) continue;
    names += (names.empty() ? "" : ", ") + std::string(TriadName(triad));
  }
  return names;
}

// All that it names.
std::vector<std::string> FilesOf(const Experiment& experiment) {
  std::vector<std::string> files = experiment.inputs;
  for (const std::string& file : {experiment.poses.file,
                                  experiment.attitudes_file,
                                  experiment.static_file,
                                  experiment.forces_file,
                                  experiment.poses.known_motions.turns_file,
                                  experiment.poses.known_motions.rates_file}) {
    if (!file.empty()) files.push_back(file);
  }
  for (const Triad triad : kTriads) {
    const std::string& file = experiment.allan_files[triad];
    if (!file.empty()) files.push_back(file);
  }
  return files;
}

Result<VerbResult> RunCheck(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment,
                             ReadExperiment(FLAGS_config, Overrides()));
  for (const std::string& input : FilesOf(experiment)) {
    std::error_code failure;
    if (std::filesystem::exists(input, failure)) continue;
    Note("note: there is no " + std::filesystem::path(input).lexically_normal().string() +
         " now; paths in an experiment are as seen from its folder");
  }
  return VerbResult{.text = FLAGS_config + ": valid; calibrates " + SensorsOf(experiment) + '\n',
                    .result = {{"config", JsonOfPlainYaml(experiment.resolved_yaml)}}};
}

}  // namespace

Command CheckCommand() {
  return {.name = "check",
          .summary = "Is this experiment valid?",
          .examples = "build/truetriad check configs/experiments/joint.yaml",
          .details =
              "Reads the experiment and its presets, but no log. Exit code 2: what is wrong, each "
              "with its line.\n",
          .flags = {{"config", "EXPERIMENT.yaml", true}, {"set", "KEY=VALUE,...", false, {}, true}},
          .words = {"config"},
          .run = RunCheck};
}

}  // namespace truetriad
