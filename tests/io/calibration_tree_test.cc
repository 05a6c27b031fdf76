// SPDX-License-Identifier: Apache-2.0
#include "io/calibration_tree.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tree/to_tree.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace calibration_tree_test {

namespace fs = std::filesystem;

TEST(CalibrationTree, OfGoldenCalibrationsSaysWhatTheirYamlDoes) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(TRUETRIAD_SOURCE_DIR "/tests/golden")) {
    SCOPED_TRACE(entry.path());
    const auto calibration = ReadCalibration(entry.path().string());
    ASSERT_TRUE(calibration) << calibration.error().message;
    EXPECT_EQ(TextOf(CalibrationTree(*calibration)),
              TextOf(TreeOfYaml(CalibrationToYaml(*calibration))));
    ++files;
  }
  EXPECT_GT(files, 0);
}

TEST(CalibrationTree, OfTextHasItsTypes) {
  EXPECT_EQ(TreeOfYaml("a: 1\nb: [1.5, .nan, x]\nc: { d: \"1\", e: true, f: ~ }\n").dump(),
            R"({"a":1,"b":[1.5,null,"x"],"c":{"d":"1","e":true,"f":null}})");
}

TEST(CalibrationTree, HasWholeNumbersAsItsFileAndVerbsHaveAllWithAPoint) {
  const Json numbers = ToTree(std::vector<double>{1.0, -0.0, 1e5, 0.5});
  EXPECT_EQ(numbers.dump(), "[1.0,-0.0,100000.0,0.5]");
  EXPECT_EQ(AsInYaml(numbers).dump(), "[1,0,100000,0.5]");
}

// People edit calibrations, too: whatever can be read has a tree.
TEST(CalibrationTree, OfAnEditedFileHasItsConfigWhateverItsStyle) {
  const std::string golden = TRUETRIAD_SOURCE_DIR "/tests/golden/accelerometer-only.yaml";
  const auto calibration = ReadCalibration(golden);
  ASSERT_TRUE(calibration) << calibration.error().message;
  const std::string yaml = CalibrationToYaml(*calibration);
  const std::string above = yaml.substr(0, yaml.find("\nconfig:") + 1);
  const auto config_of = [](const std::string& text) {
    const auto edited = CalibrationFromYaml(text, "edited.yaml");
    return edited ? CalibrationTree(*edited)["config"].dump() : edited.error().message;
  };
  EXPECT_EQ(
      config_of(above + "config:\n  note: |\n    two\n    lines\n  b: >-\n    one\n    line\n"),
      R"({"note":"two\nlines\n","b":"one line"})");
  EXPECT_EQ(config_of(above + "config: {a: &a [1, 2], b: *a}\n"), R"({"a":[1,2],"b":[1,2]})");
  EXPECT_EQ(
      config_of(above + "config: {a: &a [1], b: &b [*a, *a, *a, *a, *a], c: &c [*b, *b, *b, *b, "
                        "*b], d: [*c, *c, *c, *c, *c]}\n")
          .front(),
      '"');
}

TEST(CalibrationTree, OfWhatIsNoYamlIsItsText) {
  EXPECT_EQ(TreeOfYaml("a: *above\n").dump(), R"("a: *above\n")");
}

}  // namespace calibration_tree_test
}  // namespace truetriad
