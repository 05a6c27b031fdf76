// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_text.h"

#include <string>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

namespace truetriad {
namespace yaml_text_test {

std::string ReadBack(const std::string& text) {
  YamlText yaml;
  yaml << "name: " << Quoted{text} << "\nnext: 1\n";
  const YAML::Node node = YAML::Load(yaml.str());
  EXPECT_EQ(node["next"].as<int>(), 1) << yaml.str();
  return node["name"].as<std::string>();
}

TEST(Quoted, IsReadBackAsItWas) {
  std::string ascii;
  for (char c = 1; c != 0x7F; ++c) ascii += c;
  for (const std::string& text :
       {std::string(),
        ascii,
        std::string("\0a", 2),
        std::string("\u00B5T \u20AC \U0001F600"),
        // Ends of lines to some readers, and characters that YAML may not hold.
        std::string("a\u2028b\u2029c\u0085d\uFEFFe\u009Bf\uFFFE"),
        std::string("a: # \"b\\x\"")}) {
    EXPECT_EQ(ReadBack(text), text);
  }
}

TEST(Quoted, HasNoneOfTheEndsOfLinesOfOtherReaders) {
  YamlText yaml;
  yaml << Quoted{"a\u2028\u0085"};
  EXPECT_EQ(yaml.str(), "\"a\\u2028\\x85\"");
}

TEST(Quoted, ShowsBytesThatAreNoUtf8) { EXPECT_EQ(ReadBack("log\xFF.csv"), "log\\xFF.csv"); }

}  // namespace yaml_text_test
}  // namespace truetriad
