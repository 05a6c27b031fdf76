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
/// The first character of `text`, which must not be empty; nullopt if it is not UTF-8.
std::optional<Utf8Character> FirstCharacter(std::string_view text);
/// Appends `code`, which must be at most U+10FFFF and no surrogate.
void AppendUtf8(std::uint32_t code, std::string* to);

/// Whether all of `text` is well-formed: no overlong form, no surrogate, nothing above U+10FFFF.
bool IsUtf8(std::string_view text);

/// Copies `text`, but writes bytes that are not UTF-8 in the form \xFF, for formats that must be
/// UTF-8. Two different texts may become equal.
std::string AsUtf8(std::string_view text);

/// `text` made safe for a terminal, since a file name may contain anything: control characters
/// (except line breaks and tabs) and characters that change the direction of text are written in
/// the form \u001B, bytes that are not UTF-8 in the form \xFF.
std::string Printable(std::string_view text);
/// Like Printable, but the result is one line: line breaks and tabs are escaped as well.
std::string PrintableLine(std::string_view text);

}  // namespace truetriad
