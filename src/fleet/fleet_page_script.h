// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "json/json.h"

namespace truetriad::fleet {

// Data as text of a script. A page from the disk may load scripts, but no JSON.

/// `utf8` in quotes, in ASCII: what ends a script, a line or a string in any browser (<, quotes,
/// U+2028) is escaped. What is no UTF-8 becomes U+FFFD.
void AppendText(std::string_view utf8, std::string* script);

/// The same for the texts in `json`.
void AppendJson(const Json& json, std::string* script);

/// `number` to `digits` significant ones, or null.
void AppendNumber(double number, int digits, std::string* script);

/// `path` as it stands in a link: byte by byte, but for what is plain.
std::string LinkOf(const std::string& path);

/// A list [a,b,…], each item written by `append(item, script)`.
template <typename Items, typename Append>
void AppendList(const Items& items, const Append& append, std::string* script) {
  *script += '[';
  bool is_first = true;
  for (const auto& item : items) {
    if (!is_first) *script += ',';
    is_first = false;
    append(item, script);
  }
  *script += ']';
}

}  // namespace truetriad::fleet
