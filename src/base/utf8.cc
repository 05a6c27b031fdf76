// SPDX-License-Identifier: Apache-2.0
#include "base/utf8.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>

namespace truetriad {
namespace {

struct Character {
  std::uint32_t code = 0;
  std::size_t size = 0;  ///< Bytes.
};

/// The first of `text`, which is not empty; unset: its bytes are none.
std::optional<Character> FirstCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return Character{lead, 1};
  const std::size_t size = lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3 : lead >> 3 == 30 ? 4 : 0;
  if (size == 0 || size > text.size()) return std::nullopt;
  std::uint32_t code = lead & (0x7FU >> size);
  for (std::size_t i = 1; i < size; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte >> 6 != 2) return std::nullopt;
    code = code << 6 | (byte & 0x3FU);
  }
  constexpr std::array<std::uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast.at(size) || is_surrogate || code > 0x10FFFF) return std::nullopt;
  return Character{code, size};
}

bool TurnsText(std::uint32_t code) {
  return code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

bool IsControl(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
}

std::string Escaped(std::string_view text, std::string_view plain) {
  std::string shown;
  while (!text.empty()) {
    const std::optional<Character> character = FirstCharacter(text);
    const std::size_t size = character ? character->size : 1;
    const bool is_plain = plain.find(text[0]) != std::string_view::npos;
    std::array<char, 16> escape{};
    if (!character) {
      std::snprintf(escape.data(), escape.size(), "\\x%02X", static_cast<unsigned char>(text[0]));
    } else if (!is_plain && (IsControl(character->code) || TurnsText(character->code))) {
      std::snprintf(escape.data(), escape.size(), "\\u%04X", character->code);
    }
    if (escape[0] == '\0') {
      shown += text.substr(0, size);
    } else {
      shown += escape.data();
    }
    text.remove_prefix(size);
  }
  return shown;
}

}  // namespace

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::optional<Character> character = FirstCharacter(text);
    if (!character) return false;
    text.remove_prefix(character->size);
  }
  return true;
}

std::string Printable(std::string_view text) { return Escaped(text, "\n\t"); }

std::string PrintableLine(std::string_view text) { return Escaped(text, ""); }

}  // namespace truetriad
