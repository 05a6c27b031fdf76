// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace truetriad {

struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t size = 0;  ///< Bytes.
};
/// The first of `text`, which is not empty; unset: its bytes are none.
std::optional<Utf8Character> FirstCharacter(std::string_view text);
/// `code`: no surrogate, U+10FFFF at most.
void AppendUtf8(std::uint32_t code, std::string* to);

/// Well-formed: no overlong form, no surrogate, nothing beyond U+10FFFF.
bool IsUtf8(std::string_view text);

/// `text` with bytes that are no UTF-8 as \xFF: for formats that must be UTF-8. Two names may
/// become one.
std::string AsUtf8(std::string_view text);

/// As a terminal may show it: control characters but line breaks and tabs, and those that turn the
/// direction of text, as \u001B; bytes that are no UTF-8 as \xFF. A file can be called anything.
std::string Printable(std::string_view text);
/// The same in one line.
std::string PrintableLine(std::string_view text);

}  // namespace truetriad
