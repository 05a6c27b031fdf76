// SPDX-License-Identifier: Apache-2.0
#include "base/utf8.h"

#include <gtest/gtest.h>

namespace truetriad {
namespace utf8_test {

TEST(Utf8, IsWellFormed) {
  for (const char* text : {"", "a", "\u00B5T", "\u20AC", "\U0001F600", "\uD7FF\uE000"}) {
    EXPECT_TRUE(IsUtf8(text)) << text;
  }
  for (const char* text : {"\x80",
                           "\xC3",
                           "\xC0\xAF",          // Overlong.
                           "\xE0\x80\xAF",      // Overlong.
                           "\xED\xA0\x80",      // A surrogate.
                           "\xF4\x90\x80\x80",  // Beyond U+10FFFF.
                           "\xFF",
                           "\xE2\x82x"}) {
    EXPECT_FALSE(IsUtf8(text));
  }
}

TEST(Printable, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(Printable("a\u00B5\n\tb"), "a\u00B5\n\tb");
  EXPECT_EQ(PrintableLine("a\nb"), "a\\u000Ab");
  EXPECT_EQ(Printable("\x1B[31m\x7F\u009B\u202E"), "\\u001B[31m\\u007F\\u009B\\u202E");
  EXPECT_EQ(Printable("a\xFF"), "a\\xFF");
}

TEST(AsUtf8, ShowsBytesThatAreNone) {
  EXPECT_EQ(AsUtf8("a\u00B5\x1B"), "a\u00B5\x1B");
  EXPECT_EQ(AsUtf8("a\xFF\xC3"), "a\\xFF\\xC3");
}

TEST(AppendUtf8, IsTheInverseOfFirstCharacter) {
  for (const std::uint32_t code :
       {0x0U, 0x7FU, 0x80U, 0x7FFU, 0x800U, 0x2028U, 0xFFFFU, 0x10000U, 0x10FFFFU}) {
    std::string text;
    AppendUtf8(code, &text);
    const auto character = FirstCharacter(text);
    ASSERT_TRUE(character.has_value()) << code;
    EXPECT_EQ(character->code, code);
    EXPECT_EQ(character->size, text.size());
  }
}

}  // namespace utf8_test
}  // namespace truetriad
