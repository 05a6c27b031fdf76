// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_file.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace allan_file_test {

using ::testing::HasSubstr;

/// Numbers that are no short decimals, so that a digit lost on the way shows.
AllanResult Sample() {
  AllanResult result;
  result.source = "log \"7\".csv";
  result.serial = "A1";
  result.tags.firmware = "px4";
  result.tags.device_ids = {{std::nullopt, 1310989, std::nullopt}};
  result.inputs = {{"log.csv", "ab12", 1000}};
  AllanTriad& gyroscope = result.triads.emplace_back();
  gyroscope.triad = Triad::kGyroscope;
  gyroscope.unit = *ParseTriadUnit(Triad::kGyroscope, "deg/s");
  gyroscope.rate_hz = 100.0 / 3.0;
  gyroscope.samples = 1000;
  gyroscope.duration_s = 29.97;
  gyroscope.filled_samples = 3;
  gyroscope.breaks = 1;
  gyroscope.warnings = {"the unit moved: \\ \"quoted\""};
  AllanAxis& x = gyroscope.axes[0];
  x.points = {{0.1, {1.0 / 3.0, 0.3, 0.4}, 123.456, 999}, {0.2, {0.25, 0.2, 0.3}, 60.1, 997}};
  x.white_density = Interval{0.1 / 3.0, 0.03, 0.04};
  x.white_range_s = {0.3, 3.0};
  x.instability = BiasInstability{{0.0117, 0.01, 0.02}, {0.0077, 0.007, 0.009}, 120.0, true};
  x.random_walk = Interval{1e-4 / 3.0, 1e-5, 2e-4};
  x.quantisation = Interval{1e-7 / 3.0, 1e-8, 2e-7};
  gyroscope.axes[1].points = x.points;
  return result;
}

void ExpectEqual(const Interval& a, const Interval& b) {
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
}

TEST(AllanFile, ReadsBackToTheSameBits) {
  const TemporaryFolder folder;
  const AllanResult written = Sample();
  const auto read = ReadAllanFile(folder.Write("allan.yaml", AllanToYaml(written)));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->source, written.source);
  EXPECT_EQ(read->tags, written.tags);
  ASSERT_EQ(read->triads.size(), 1U);
  const AllanTriad& a = written.triads[0];
  const AllanTriad& b = read->triads[0];
  EXPECT_EQ(a.unit.name, b.unit.name);
  EXPECT_EQ(a.rate_hz, b.rate_hz);
  EXPECT_EQ(a.warnings, b.warnings);
  EXPECT_EQ(a.filled_samples, b.filled_samples);
  EXPECT_EQ(a.breaks, b.breaks);
  ASSERT_EQ(b.axes[0].points.size(), 2U);
  EXPECT_EQ(a.axes[0].points[0].tau_s, b.axes[0].points[0].tau_s);
  ExpectEqual(a.axes[0].points[0].deviation, b.axes[0].points[0].deviation);
  ExpectEqual(*a.axes[0].white_density, *b.axes[0].white_density);
  EXPECT_EQ(a.axes[0].white_range_s, b.axes[0].white_range_s);
  ExpectEqual(a.axes[0].instability->coefficient, b.axes[0].instability->coefficient);
  ExpectEqual(a.axes[0].instability->minimum, b.axes[0].instability->minimum);
  EXPECT_EQ(a.axes[0].instability->tau_s, b.axes[0].instability->tau_s);
  EXPECT_TRUE(b.axes[0].instability->at_end);
  ExpectEqual(*a.axes[0].random_walk, *b.axes[0].random_walk);
  ExpectEqual(*a.axes[0].quantisation, *b.axes[0].quantisation);
  EXPECT_EQ(AllanToYaml(*read), AllanToYaml(written));
}

TEST(AllanFile, LeavesOutWhatTheDataDoNotShow) {
  const TemporaryFolder folder;
  const auto read = ReadAllanFile(folder.Write("allan.yaml", AllanToYaml(Sample())));
  ASSERT_TRUE(read);
  const AllanAxis& y = read->triads[0].axes[1];
  EXPECT_FALSE(y.white_density || y.instability || y.random_walk || y.quantisation);
  EXPECT_TRUE(read->triads[0].axes[2].points.empty());
}

TEST(AllanFile, HoldsNoCoefficientsOfASensorThatWasNotAtRest) {
  const TemporaryFolder folder;
  AllanResult disturbed = Sample();
  disturbed.triads[0].disturbance = "the unit moved: \"12\" s";
  const std::string text = AllanToYaml(disturbed);
  EXPECT_THAT(text, HasSubstr("status: not_at_rest\n"));
  const auto refused = ReadAllanFile(folder.Write("allan.yaml", text));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("coefficients for a sensor that was not at rest"));

  AllanAxis& x = disturbed.triads[0].axes[0];
  const std::vector<AllanPoint> points = x.points;
  x = AllanAxis();
  x.points = points;
  const auto read = ReadAllanFile(folder.Write("allan.yaml", AllanToYaml(disturbed)));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->triads[0].disturbance, disturbed.triads[0].disturbance);
  EXPECT_FALSE(read->at_rest());
  EXPECT_EQ(read->triads[0].axes[0].points.size(), 2U);
}

TEST(AllanFile, RejectsAnotherFormatWithItsLine) {
  const TemporaryFolder folder;
  const auto read =
      ReadAllanFile(folder.Write("c.yaml", "format: truetriad/calibration/1\nstatus: {}\n"));
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(read.error().message, HasSubstr("c.yaml:1: format: is `truetriad/calibration/1`"));
}

TEST(AllanFile, RejectsACoefficientInAnotherUnitThanItsSensor) {
  const TemporaryFolder folder;
  std::string text = AllanToYaml(Sample());
  text.replace(text.find("unit: \"deg/s\""), 13, "unit: \"rad/s\"");
  const auto read = ReadAllanFile(folder.Write("allan.yaml", text));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("expected `rad/s/sqrt(Hz)`"));
}

TEST(AllanFile, RejectsUnknownKeysAndIntervalsThatAreNone) {
  const TemporaryFolder folder;
  std::string text = AllanToYaml(Sample());
  text.replace(text.find("breaks: 1"), 9, "brakes: 1");
  text.replace(text.find("low: 0.03,"), 10, "low: 0.05,");
  const auto read = ReadAllanFile(folder.Write("allan.yaml", text));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("did you mean `breaks`?"));
  EXPECT_THAT(read.error().message, HasSubstr("noise_density: is not an interval"));
}

}  // namespace allan_file_test
}  // namespace truetriad
