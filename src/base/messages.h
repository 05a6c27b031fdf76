// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace truetriad {

// What a run has to say to people, in the order it came up.
using Messages = std::vector<std::string>;

// `value` in the one printf conversion of `format`.
inline std::string Format(const char* format, double value) {
  char text[256];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// "1 pose", "3 poses".
inline std::string Counted(long long count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace truetriad
