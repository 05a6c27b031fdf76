// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <vector>

#include "base/rounded_text.h"

namespace truetriad {

// Numbers for files of other programs: independent of the locale, as few digits as read back to the
// same bits.
template <typename Number>
std::string NumberText(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// The same without an exponent.
template <typename Number>
std::string PlainNumberText(Number value) {
  char text[512];  // 1e-308 has that many digits
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

// A float constant of C.
inline std::string FloatLiteral(float value) {
  std::string text = NumberText(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + "f";
}

inline std::string CommentText(std::string_view prefix, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text.append(prefix).append(line).append("\n");
  return text;
}

}  // namespace truetriad
