// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_text.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "base/utf8.h"

namespace truetriad {
namespace {

/// Whether a character must be escaped: YAML requires it, or some readers mistake the character for
/// a line end.
bool NeedsEscape(std::uint32_t code) {
  constexpr std::uint32_t kLineSeparator = 0x2028, kParagraphSeparator = 0x2029;  // Unicode's.
  constexpr std::uint32_t kByteOrderMark = 0xFEFF;                                // Unicode's.
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == kLineSeparator ||
         code == kParagraphSeparator || code == kByteOrderMark || code == 0xFFFE || code == 0xFFFF;
}

}  // namespace

YamlText& YamlText::operator<<(Quoted quoted) {
  const std::string good = AsUtf8(quoted.text);
  text_ += '"';
  for (std::string_view text = good; !text.empty();) {
    const Utf8Character character = *FirstCharacter(text);
    if (text[0] == '"' || text[0] == '\\') {
      text_ += {'\\', text[0]};
    } else if (NeedsEscape(character.code)) {
      std::array<char, 16> escape{};
      std::snprintf(escape.data(),
                    escape.size(),
                    character.code < 0x100 ? "\\x%02x" : "\\u%04x",
                    character.code);
      text_ += escape.data();
    } else {
      text_ += text.substr(0, character.size);
    }
    text.remove_prefix(character.size);
  }
  text_ += '"';
  return *this;
}

}  // namespace truetriad
