// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page_script.h"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

namespace truetriad::fleet {

void AppendText(std::string_view utf8, std::string* script) { AppendJson(Json(utf8), script); }

void AppendJson(const Json& json, std::string* script) {
  const std::string text =
      json.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
  for (const char c : text) {
    if (c == '<') {
      *script += "\\u003c";
    } else {
      *script += c;
    }
  }
}

void AppendNumber(double number, int digits, std::string* script) {
  if (!std::isfinite(number)) {
    *script += "null";
    return;
  }
  std::array<char, 32> text{};
  char* const end =
      std::to_chars(
          text.data(), text.data() + text.size(), number, std::chars_format::general, digits)
          .ptr;
  script->append(text.data(), end);
}

std::string LinkOf(const std::string& path) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string link;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) ||
        std::string_view("-_./~").find(c) != std::string_view::npos) {
      link += c;
    } else {
      link += {'%', kDigits[byte >> 4], kDigits[byte & 15U]};
    }
  }
  return link;
}

}  // namespace truetriad::fleet
