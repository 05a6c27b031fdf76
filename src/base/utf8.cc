// SPDX-License-Identifier: Apache-2.0
#include "base/utf8.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>

namespace truetriad {
namespace {

bool TurnsText(std::uint32_t code) {
  return code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

bool IsControl(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
}

/// Writes a byte that is not UTF-8 in the form \xFF.
std::string ByteText(char byte) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  const auto value = static_cast<unsigned char>(byte);
  return {'\\', 'x', kHex[value >> 4U], kHex[value & 15U]};
}

/// Copies `text`, but writes characters for which `needs_escape(code)` holds in the form \u001B,
/// and bytes that are not UTF-8 in the form \xFF.
template <typename NeedsEscape>
std::string Escaped(std::string_view text, const NeedsEscape& needs_escape) {
  std::string shown;
  while (!text.empty()) {
    const std::optional<Utf8Character> character = FirstCharacter(text);
    const std::size_t size = character ? character->size : 1;
    if (!character) {
      shown += ByteText(text[0]);
    } else if (needs_escape(character->code)) {
      std::array<char, 16> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04X", character->code);
      shown += escape.data();
    } else {
      shown += text.substr(0, size);
    }
    text.remove_prefix(size);
  }
  return shown;
}

bool IsNotForATerminal(std::uint32_t code) { return IsControl(code) || TurnsText(code); }

}  // namespace

std::optional<Utf8Character> FirstCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return Utf8Character{lead, 1};
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
  return Utf8Character{code, size};
}

void AppendUtf8(std::uint32_t code, std::string* to) {
  const auto tail = [&](int shift) { *to += static_cast<char>(0x80U | (code >> shift & 0x3FU)); };
  if (code < 0x80) {
    *to += static_cast<char>(code);
  } else if (code < 0x800) {
    *to += static_cast<char>(0xC0U | code >> 6);
    tail(0);
  } else if (code < 0x10000) {
    *to += static_cast<char>(0xE0U | code >> 12);
    tail(6), tail(0);
  } else {
    *to += static_cast<char>(0xF0U | code >> 18);
    tail(12), tail(6), tail(0);
  }
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::optional<Utf8Character> character = FirstCharacter(text);
    if (!character) return false;
    text.remove_prefix(character->size);
  }
  return true;
}

std::string AsUtf8(std::string_view text) {
  return Escaped(text, [](std::uint32_t /*code*/) { return false; });
}

std::string Printable(std::string_view text) {
  return Escaped(text, [](std::uint32_t code) {
    return code != '\n' && code != '\t' && IsNotForATerminal(code);
  });
}

std::string PrintableLine(std::string_view text) { return Escaped(text, IsNotForATerminal); }

}  // namespace truetriad
