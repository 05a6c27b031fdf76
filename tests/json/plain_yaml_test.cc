// SPDX-License-Identifier: Apache-2.0
#include "json/plain_yaml.h"

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "io/temporary_folder.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace plain_yaml_test {

namespace fs = std::filesystem;

// The same tree as a general reader sees it.
void ExpectSame(const Json& json, const YAML::Node& yaml, const std::string& where) {
  SCOPED_TRACE(where);
  if (yaml.IsMap()) {
    ASSERT_TRUE(json.is_object());
    ASSERT_EQ(json.size(), yaml.size());
    auto member = json.begin();
    for (const auto& item : yaml) {
      const auto name = item.first.as<std::string>();
      ASSERT_EQ(member.key(), name);
      ExpectSame(*member, item.second, where + "." + name);
      ++member;
    }
  } else if (yaml.IsSequence()) {
    ASSERT_TRUE(json.is_array());
    ASSERT_EQ(json.size(), yaml.size());
    for (std::size_t i = 0; i < json.size(); ++i) ExpectSame(json[i], yaml[i], where + "[]");
  } else if (json.is_string()) {
    EXPECT_EQ(json.get<std::string>(), yaml.as<std::string>());
  } else if (json.is_boolean()) {
    EXPECT_EQ(json.get<bool>(), yaml.as<bool>());
  } else if (json.is_number()) {
    EXPECT_EQ(json.get<double>(), yaml.as<double>());
    EXPECT_NE(yaml.Tag(), "!") << "a quoted word became a number";
  } else {
    const bool is_number_that_is_none = !yaml.IsNull() && !std::isfinite(yaml.as<double>());
    EXPECT_TRUE(json.is_null() && (yaml.IsNull() || is_number_that_is_none));
  }
}

void ExpectSame(const std::string& text) {
  ExpectSame(JsonOfPlainYaml(text), YAML::Load(text), "");
}

TEST(PlainYaml, IsReadAsAGeneralReaderDoes) {
  for (const char* text : {
           "a: 1\nb: [1, 2.5, -3e-4]\nc: { d: x, e: [1], f: {} }\ng: []\n",
           "a:\n  b:\n    c: true\n  d: null\ne:\n",
           "list:\n  - 1\n  - { a: 1 }\n  - a: 1\n    b: two words\n  - [1, 2]\n",
           "list:\n- a: 1\n  b: 2\n- a: 3\n",
           "a: \"1\"  # quoted\nb: \"a: b # c, [d]\"  # default\n# a line\nc: \"q \\\" \\\\ \\x0a "
           "e\"\n",
           "a: \"\\u2028\\x85\\ufeff µ\"\n",
           "a: 2026-01-31T12:00:00Z\nb: .nan\nc: .inf\nd: accel-x\ne: +x\n",
           "- 1\n- - 2\n  - 3\n",
           "a: { first: 1, last: 246, id: \"1: z up, x 33 deg\" }\n",
       }) {
    SCOPED_TRACE(text);
    ExpectSame(text);
  }
}

TEST(PlainYaml, OfGoldenCalibrationsIsTheirTree) {
  int files = 0;
  for (const char* folder : {"datasets", "tests/formats/golden", "tests/io/golden"}) {
    const fs::path path = fs::path(TRUETRIAD_SOURCE_DIR) / folder;
    if (!fs::exists(path)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path)) {
      const std::string text =
          entry.path().extension() == ".yaml" ? TemporaryFolder::Read(entry.path().string()) : "";
      if (!text.starts_with("format: truetriad/")) continue;
      SCOPED_TRACE(entry.path());
      ExpectSame(text);
      ++files;
    }
  }
  EXPECT_GT(files, 0);
}

TEST(PlainYaml, OfEveryShippedExperimentIsItsTree) {
  const fs::path folder = fs::path(TRUETRIAD_SOURCE_DIR) / "configs" / "experiments";
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    SCOPED_TRACE(entry.path());
    const auto experiment = ReadExperiment(entry.path().string());
    ASSERT_TRUE(experiment) << experiment.error().message;
    ExpectSame(experiment->resolved_yaml);
  }
}

TEST(PlainYamlDeathTest, RefusesWhatThisProgramDoesNotWrite) {
  EXPECT_DEATH(JsonOfPlainYaml("a: |\n  text\n"), "");
  EXPECT_DEATH(JsonOfPlainYaml("a: [1,\n"), "end");
  EXPECT_DEATH(JsonOfPlainYaml("a: 1\n   b: 2\n"), "");
}

}  // namespace plain_yaml_test
}  // namespace truetriad
