// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "support/finding_matchers.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace golden_calibration_test {

using ::testing::Each;

// Files that the program wrote before findings and the mode had keys of their own, one of each
// mode, and what they are.
struct Golden {
  std::string name;
  Mode mode = Mode::kPoses;
  Outcome outcome = Outcome::kConverged;
  int poses = 0;
};

std::string Text(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Everything that yesterday's file says is said as it was; keys may have come.
void ExpectHolds(const YAML::Node& yesterday, const YAML::Node& today, const std::string& at) {
  ASSERT_EQ(yesterday.Type(), today.Type()) << at;
  if (yesterday.IsScalar()) {
    EXPECT_EQ(yesterday.Scalar(), today.Scalar()) << at;
  }
  if (yesterday.IsSequence()) {
    ASSERT_EQ(yesterday.size(), today.size()) << at;
    for (std::size_t i = 0; i < yesterday.size(); ++i) {
      ExpectHolds(yesterday[i], today[i], at + "." + std::to_string(i));
    }
  }
  if (!yesterday.IsMap()) return;
  for (const auto& entry : yesterday) {
    const std::string& key = entry.first.Scalar();
    ASSERT_TRUE(today[key]) << at << "." << key;
    ExpectHolds(entry.second, today[key], at + "." + key);
  }
}

class GoldenCalibration : public ::testing::TestWithParam<Golden> {};

TEST_P(GoldenCalibration, IsReadAndWrittenAgainWithTheSameValues) {
  const Golden& golden = GetParam();
  const std::string path = TRUETRIAD_SOURCE_DIR "/tests/golden/" + golden.name + ".yaml";
  const std::string yesterday = Text(path);
  const Result<Calibration> calibration = CalibrationFromYaml(yesterday, path);
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(calibration->mode, golden.mode);
  EXPECT_EQ(calibration->outcome, golden.outcome);
  EXPECT_EQ(calibration->quality.poses, golden.poses);
  // Messages without codes; of a run that was refused any may be why.
  EXPECT_THAT(calibration->findings, Each(HasCode(FindingCode::kMessage)));
  EXPECT_EQ(OutcomeOf(calibration->findings) == Outcome::kConverged, calibration->IsUsable());

  const std::string today = CalibrationToYaml(*calibration);
  ExpectHolds(YAML::Load(yesterday), YAML::Load(today), golden.name);
  const Result<Calibration> again = CalibrationFromYaml(today, "today");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->mode, golden.mode);
  EXPECT_EQ(CalibrationToYaml(*again), today);
}

INSTANTIATE_TEST_SUITE_P(
    Of,
    GoldenCalibration,
    ::testing::Values(Golden{"accelerometer-only", Mode::kPoses, Outcome::kConverged, 24},
                      Golden{"joint", Mode::kPoses, Outcome::kConverged, 24},
                      Golden{"nine-axis", Mode::kPoses, Outcome::kConverged, 24},
                      Golden{"mag-poor-coverage", Mode::kPoses, Outcome::kNotObservable, 1266},
                      Golden{"tumble", Mode::kMotion, Outcome::kConverged, 1251},
                      Golden{"sweep", Mode::kSweep, Outcome::kConverged, 47}),
    [](const auto& test) {
      std::string name = test.param.name;
      for (char& letter : name) letter = letter == '-' ? '_' : letter;
      return name;
    });

}  // namespace golden_calibration_test
}  // namespace truetriad
