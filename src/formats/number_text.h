// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>

namespace truetriad {

// Numbers for files of other programs, independent of the locale: the fewest digits that read back
// to the same bits.
template <typename Number>
std::string NumberText(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// As NumberText, but without an exponent.
template <typename Number>
std::string PlainNumberText(Number value) {
  char text[512];  // 1e-308 has over 308 digits.
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

}  // namespace truetriad
