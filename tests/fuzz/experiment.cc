// SPDX-License-Identifier: Apache-2.0
//
// An experiment, its plan included; what it resolves to must read back as itself.
#include "truetriad/config/experiment.h"

#include "fuzz/fuzz_target.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

/// Without the comments by which defaults are told from what was stated.
std::string WithoutMarks(const std::string& yaml) {
  std::string text;
  std::size_t begin = 0;
  while (begin < yaml.size()) {
    std::size_t end = yaml.find('\n', begin);
    if (end == std::string::npos) end = yaml.size();
    std::string line = yaml.substr(begin, end - begin);
    constexpr std::string_view kMark = "  # default";
    if (line.ends_with(kMark)) line.resize(line.size() - kMark.size());
    text += line + "\n";
    begin = end + 1;
  }
  return text;
}

/// What experiments name: defaults of a sensor.
std::string Surroundings() {
  fuzz::WriteInput(
      "preset.yaml",
      "sensor_preset: 1\naccelerometer: { noise: { sigma: [1.5e-3, 1.5e-3, 1.5e-3] } }\n");
  return fuzz::Folder() + "/experiment.yaml";
}

}  // namespace

TRUETRIAD_FUZZ_TARGET(experiment) {
  static const std::string path = Surroundings();
  const Result<Experiment> experiment = ReadExperimentText(std::string(fuzz::TextOf(input)), path);
  if (!experiment) {
    fuzz::MustSay(experiment.error());
    return 0;
  }
  const Result<Experiment> again = ReadExperimentText(experiment->resolved_yaml, path);
  if (!again)
    fuzz::Must(false,
               "an experiment's resolved text can be read",
               again.error().message + "\n" + experiment->resolved_yaml);
  fuzz::Must(WithoutMarks(again->resolved_yaml) == WithoutMarks(experiment->resolved_yaml),
             "an experiment resolves to itself",
             experiment->resolved_yaml + again->resolved_yaml);
  return 0;
}
