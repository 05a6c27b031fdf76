// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>

namespace truetriad {

// `value` with `digits` significant digits, for a reader.
inline std::string RoundedText(double value, int digits) {
  char text[64];
  return {text,
          std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr};
}

// `value` with one decimal; further decimals are cut off, not rounded.
inline std::string Fixed1(double value) {
  const std::string text = std::to_string(value);
  return text.substr(0, text.find('.') + 2);
}

}  // namespace truetriad
