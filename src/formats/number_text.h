// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>

namespace truetriad {

// The text of a number, for files that other programs read: the fewest digits from which the same
// bits are read back. It does not depend on the locale.
template <typename Number>
std::string NumberText(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Like NumberText, but never with an exponent.
template <typename Number>
std::string PlainNumberText(Number value) {
  char text[512];  // 1e-308 has over 308 digits.
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

}  // namespace truetriad
