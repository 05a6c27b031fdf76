// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_reader.h"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace yaml_reader_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string ParseError(const std::string& text) {
  const Result<YamlReader> yaml = YamlReader::FromText(text, "file.yaml");
  return yaml ? "" : yaml.error().message;
}

TEST(YamlReader, ReadsEachType) {
  YamlReader yaml = *YamlReader::FromText(
      "text: abc\nnumber: +1.5e3\ncount: -7\nyes: true\nlist: [1, 2, 3]\nmap: {a: 1}\n", "f");
  std::string text;
  double number = 0.0;
  int count = 0;
  bool yes = false;
  std::vector<double> list;
  Eigen::Vector3d vector;
  EXPECT_TRUE(yaml.Require("text", &text));
  EXPECT_TRUE(yaml.Require("number", &number));
  EXPECT_TRUE(yaml.Require("count", &count));
  EXPECT_TRUE(yaml.Require("yes", &yes));
  EXPECT_TRUE(yaml.Require("list", &list));
  EXPECT_TRUE(yaml.Require("list", &vector));
  EXPECT_THAT(yaml.Child("map").Keys(), ElementsAre("a"));
  EXPECT_EQ(text, "abc");
  EXPECT_EQ(number, 1500.0);
  EXPECT_EQ(count, -7);
  EXPECT_TRUE(yes);
  EXPECT_THAT(list, ElementsAre(1.0, 2.0, 3.0));
  EXPECT_EQ(vector, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_TRUE(yaml.status());
}

TEST(YamlReader, LeavesOptionalValuesAloneWhenTheyAreAbsent) {
  YamlReader yaml = *YamlReader::FromText("a: 1\n", "f");
  double value = 42.0;
  EXPECT_FALSE(yaml.Optional("b", &value));
  EXPECT_EQ(value, 42.0);
  EXPECT_TRUE(yaml.status());
}

TEST(YamlReader, RejectsDuplicateKeysAtAnyDepthWithTheirLine) {
  EXPECT_THAT(ParseError("a: 1\nb: 2\na: 3\n"), HasSubstr("file.yaml:3: a: is given twice"));
  EXPECT_THAT(ParseError("list:\n  - x: 1\n    x: 2\n"),
              HasSubstr("file.yaml:3: list[0].x: is given twice"));
}

TEST(YamlReader, RejectsUnknownKeysAndListsTheKnownOnes) {
  YamlReader yaml = *YamlReader::FromText("a: 1\nsub:\n  b: 2\n  bb: 3\n", "file.yaml");
  YamlReader sub = yaml.Child("sub");
  sub.Child("b");
  sub.RejectUnknown();
  EXPECT_EQ(sub.status().error().message,
            "file.yaml:4: sub.bb: is not a known key; expected one of b (did you mean `b`?)");
}

TEST(YamlReader, CollectsAllErrors) {
  YamlReader yaml = *YamlReader::FromText("a: x\nb: .inf\n", "file.yaml");
  double value = 0.0;
  yaml.Require("a", &value);
  yaml.Require("b", &value);
  yaml.Require("c", &value);
  const std::string message = yaml.status().error().message;
  EXPECT_THAT(message, HasSubstr("file.yaml:1: a: `x` is not a finite number"));
  EXPECT_THAT(message, HasSubstr("file.yaml:2: b: `.inf` is not a finite number"));
  EXPECT_THAT(message, HasSubstr("file.yaml:1: c: is missing"));
}

TEST(YamlReader, CountsTheCharactersOfANameAsTheyAreWritten) {
  const std::string bytes(YamlReader::kLongestName / 2, '\xFF');  // Each is written as \\xFF.
  YamlReader yaml = *YamlReader::FromText("name: " + bytes + "\n", "file.yaml");
  std::string name;
  YamlReader child = yaml.Child("name");
  EXPECT_FALSE(child.ReadName(&name));
  EXPECT_THAT(yaml.status().error().message,
              HasSubstr("name: has " + std::to_string(4 * bytes.size()) + " characters"));
}

TEST(YamlReader, RejectsWrongTypes) {
  YamlReader yaml = *YamlReader::FromText("map: {}\nempty:\nfloat: 1.5\nbig: 9999999999\n", "f");
  double number = 0.0;
  int count = 0;
  bool flag = false;
  Eigen::Vector3d vector;
  EXPECT_FALSE(yaml.Require("map", &number));
  EXPECT_FALSE(yaml.Require("empty", &number));
  EXPECT_FALSE(yaml.Require("float", &count));
  EXPECT_FALSE(yaml.Require("big", &count));
  EXPECT_FALSE(yaml.Require("float", &flag));
  EXPECT_FALSE(yaml.Require("float", &vector));
  EXPECT_FALSE(yaml.Child("float").RequireChild("x"));
  EXPECT_TRUE(yaml.Child("float").Items().empty());
}

TEST(YamlReader, SaysWhatIsWrongWithTheFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(ParseError("a: [1, 2\nb: 3\n"), HasSubstr("is not valid YAML"));
  EXPECT_THAT(ParseError("columns: { time: time[s], accelerometer: [x[g], y[g], z[g]] }\n"),
              AllOf(HasSubstr("is not valid YAML"), HasSubstr("needs quotes: 'time[s]'")));
  EXPECT_THAT(ParseError("columns:\n  accelerometer: [x[g], y[g], z[g]]\n  time: t[s]\n"),
              HasSubstr("needs quotes"));
  EXPECT_THAT(ParseError("a: [1, 2\nb: 3\n"), Not(HasSubstr("quotes")));
  EXPECT_THAT(ParseError("just text"), HasSubstr("is not a YAML map"));
  EXPECT_THAT(ParseError(std::string("a: \0", 4)), HasSubstr("binary"));
  EXPECT_THAT(YamlReader::FromFile(folder.Path("none.yaml")).error().message,
              HasSubstr("none.yaml: cannot be read: No such file"));
  EXPECT_THAT(YamlReader::FromFile(folder.Path("")).error().message, HasSubstr("is a folder"));
}

TEST(YamlReader, DoesNotChokeOnNestedAliases) {
  std::ostringstream text;
  text << "a0: &a0 [x, x]\n";
  for (int i = 1; i < 60; ++i) {
    text << "a" << i << ": &a" << i << " [*a" << i - 1 << ", *a" << i - 1 << "]\n";
  }
  EXPECT_EQ(ParseError(text.str()), "");
}

}  // namespace yaml_reader_test
}  // namespace truetriad
