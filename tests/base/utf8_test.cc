// SPDX-License-Identifier: Apache-2.0
#include "base/utf8.h"

#include <gtest/gtest.h>

namespace truetriad {
namespace {

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

}  // namespace
}  // namespace truetriad
