// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/flags.h"

#include <utility>

DEFINE_string(input,
              "",
              "the log: a self-describing CSV (also .gz), a manifest recording.yaml, or for "
              "`convert` a log of another system");
DEFINE_string(output, "", "what to write");
DEFINE_string(config, "", "what to do, as a YAML file: configs has examples, docs all keys");
DEFINE_string(calibration, "", "calibration.yaml as `calibrate` writes it");
DEFINE_string(poses,
              "",
              "where the poses are: detect, every_row, every:N, column:NAME, file:PATH, sweep or "
              "sweep:SECONDS (default: what the recording states, else detect)");
DEFINE_string(set,
              "",
              "comma-separated values that take the place of those in the file of --config, as in "
              "robust.loss=none,gauge=accel-z; commas inside [] or {} do not separate");

namespace truetriad {

std::vector<std::string> Overrides() {
  std::vector<std::string> items;
  std::string item;
  int depth = 0;
  char quote = '\0';
  for (const char c : FLAGS_set) {
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == ',' && depth <= 0) {
      items.push_back(std::exchange(item, ""));
      continue;
    }
    item += c;
  }
  if (!item.empty()) items.push_back(item);
  return items;
}

}  // namespace truetriad
