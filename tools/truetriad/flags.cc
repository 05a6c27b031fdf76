// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/flags.h"

#include <utility>

DEFINE_string(input,
              "",
              "the log: a self-describing CSV (also .gz), a manifest recording.yaml, or, for "
              "`convert`, another system's log");
DEFINE_string(output, "", "file or folder to write");
DEFINE_string(config,
              "",
              "YAML file that describes the task; examples are in configs, all keys in docs");
DEFINE_string(calibration, "", "calibration.yaml written by `calibrate`");
DEFINE_string(poses,
              "",
              "how to find the poses: detect, every_row, every:N, column:NAME, file:PATH, sweep or "
              "sweep:SECONDS (default: as stated in the recording, else detect)");
DEFINE_string(set,
              "",
              "values that replace those in the --config file, separated by commas, as in "
              "robust.loss=none,gauge=accel-z; commas inside [] or {} do not separate");

namespace truetriad {

std::vector<std::string> Overrides() {
  std::vector<std::string> items;
  std::string item;
  int depth = 0;
  char quote = '\0';
  for (const char c : FLAGS_set) {
    if (quote != '\0' && c != '\n') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == '\n' || (c == ',' && depth <= 0)) {
      items.push_back(std::exchange(item, ""));
      continue;
    }
    item += c;
  }
  if (!item.empty()) items.push_back(item);
  return items;
}

}  // namespace truetriad
