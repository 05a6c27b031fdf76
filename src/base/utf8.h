// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace truetriad {

/// Well-formed: no overlong form, no surrogate, nothing beyond U+10FFFF.
bool IsUtf8(std::string_view text);

/// As a terminal may show it: control characters but line breaks and tabs, and those that turn the
/// direction of text, as \u001B; bytes that are no UTF-8 as \xFF. A file can be called anything.
std::string Printable(std::string_view text);
/// The same in one line.
std::string PrintableLine(std::string_view text);

}  // namespace truetriad
