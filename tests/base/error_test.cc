// SPDX-License-Identifier: Apache-2.0
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "truetriad/base/result.h"

namespace truetriad {
namespace error_test {

TEST(Errors, HaveNamesThatScriptsCanRelyOn) {
  const std::regex kebab("[a-z]+(-[a-z]+)*");
  std::set<std::string_view> names;
  for (const ErrorInfo& info : AllErrorCodes()) {
    EXPECT_TRUE(std::regex_match(std::string(info.name), kebab)) << info.name;
    EXPECT_TRUE(names.insert(info.name).second) << info.name << " twice";
    EXPECT_EQ(&InfoOf(info.code), &info);
    EXPECT_FALSE(info.meaning.empty() || info.remedy.empty()) << info.name;
  }
}

TEST(Errors, BeginWithTheirPlace) {
  const Error error(ErrorCode::kUnreadableNumber, {"a.csv", 7, 2}, "`x` is not a number");
  EXPECT_EQ(error.message, "a.csv:7: `x` is not a number");
  EXPECT_EQ(error.What(), "`x` is not a number");
  EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
  EXPECT_EQ(Error(ErrorCode::kEmptyFile, {"a.csv"}, "is empty").message, "a.csv: is empty");
}

TEST(Errors, FindThePlaceInWords) {
  const auto place = [](const std::string& text) {
    return ErrorIn(ErrorCode::kInvalidValue, text, "wrong").place;
  };
  EXPECT_EQ(place("unit.yaml:12").file, "unit.yaml");
  EXPECT_EQ(place("unit.yaml:12").line, 12);
  EXPECT_EQ(place("C:unit.yaml:12: exclude[0]").file, "C:unit.yaml");
  EXPECT_EQ(place("C:unit.yaml:12: exclude[0]").line, 12);
  EXPECT_EQ(place("unit.yaml: rates").file, "unit.yaml");
  EXPECT_EQ(place("unit.yaml: rates").line, 0);
}

TEST(Errors, AreJoinedUnderTheFirst) {
  const Error first(ErrorCode::kUnknownKey, {"a.yaml", 3}, "one");
  const Error both = Joined({first, Error(ErrorCode::kMissingKey, {"a.yaml", 9}, "two")});
  EXPECT_EQ(both.code, ErrorCode::kUnknownKey);
  EXPECT_EQ(both.place.line, 3);
  EXPECT_EQ(both.message, "a.yaml:3: one\na.yaml:9: two");
}

}  // namespace error_test
}  // namespace truetriad
