// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>
#include <vector>

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

Result<int> RunCheck(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment,
                             ReadExperiment(FLAGS_config, Overrides()));
  std::printf("%s: valid; calibrates %s\n", FLAGS_config.c_str(), SensorsOf(experiment).c_str());
  return kExitGood;
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
