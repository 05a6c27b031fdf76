// SPDX-License-Identifier: Apache-2.0
#include "report/table.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace table_test {

TEST(TextOf, AlignsColumnsByWhatIsSeenNotByBytes) {
  EXPECT_EQ(TextOf({{"name", "value"}, "lr", {{"σ", "0.5"}, {"bias", "12.5"}}}, 0),
            "name   value\n"
            "σ        0.5\n"
            "bias    12.5\n");
}

TEST(TextOf, WrapsALongLastColumnUnderItself) {
  const std::string text = TextOf(
      {{"pose", "reason"},
       "rl",
       {{"7", std::string(30, 'a') + ' ' + std::string(30, 'b') + ' ' + std::string(40, 'c')}}});
  EXPECT_THAT(text, ::testing::HasSubstr('\n' + std::string(9, ' ') + std::string(40, 'c')));
}

TEST(TextOf, IsEmptyWithoutRows) { EXPECT_EQ(TextOf({{"pose"}, "r", {}}), ""); }

TEST(Wrapped, KeepsControlCharactersFromTheTerminal) {
  EXPECT_EQ(Wrapped("a\x1b[2Jb\nc", 0), "a\\u001B[2Jb c\n");
}

TEST(Wrapped, KeepsWithinTheWidthAndIndentsUnderTheLead) {
  std::string words;
  for (int i = 0; i < 60; ++i) words += "word ";
  const std::string text = Wrapped(words, 2, "- ");
  EXPECT_TRUE(text.starts_with("  - word"));
  EXPECT_THAT(text, ::testing::HasSubstr("\n    word"));
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    EXPECT_LE(end - begin, kTextWidth);
  }
}

}  // namespace table_test
}  // namespace truetriad
