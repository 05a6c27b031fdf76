// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <string>

namespace truetriad {

// The text of a number for files of other programs: the fewest digits that read back to the same
// bits. It does not depend on the locale.
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
