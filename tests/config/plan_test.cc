// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace plan_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class PlanBlock : public ::testing::Test {
 protected:
  Result<Experiment> Read(const std::string& block,
                          const std::vector<std::string>& overrides = {}) {
    return ReadExperiment(
        folder_.Write("plan.yaml",
                      "experiment: 1\nsensors: { accelerometer: {} }\nplan:\n" + block),
        overrides);
  }

  TemporaryFolder folder_;
};

TEST_F(PlanBlock, IsReadWithItsUnitsAndDefaults) {
  const auto experiment = Read(
      "  wanted: { accelerometer.bias: 0.002 }\n  rotations: { spread: 100 }\n  criterion: D\n"
      "  start: recording\n  rest_s: 5\n  seed: 7\n"
      "  nominal: { accelerometer: { unit: counts, sensitivity: 400 }, dip_deg: -30 }\n");
  ASSERT_TRUE(experiment) << experiment.error().message;
  ASSERT_TRUE(experiment->plan);
  const PlanConfig& plan = *experiment->plan;
  EXPECT_EQ(plan.options.poses, 0);
  EXPECT_EQ(plan.options.wanted.at("accelerometer.bias"), 0.002);
  EXPECT_EQ(plan.options.max_poses, 60);
  EXPECT_EQ(plan.options.grid.attitudes.size(), 100U);
  EXPECT_TRUE(plan.options.grid.continuous);
  EXPECT_EQ(plan.options.criterion, PlanCriterion::kDeterminant);
  EXPECT_TRUE(plan.from_recording);
  EXPECT_EQ(plan.options.rest_s, 5.0);
  EXPECT_EQ(plan.options.seed, 7U);
  const NominalSensor& nominal = plan.nominal[Triad::kAccelerometer];
  EXPECT_TRUE(nominal.unit->is_counts);
  EXPECT_EQ((*nominal.sensitivity)(1, 1), 400.0);
  EXPECT_EQ(plan.options.nominal_dip_rad, -30.0 * kRadPerDeg);
}

TEST_F(PlanBlock, TakesOverrides) {
  const auto experiment = Read("  poses: 12\n", {"plan.poses=9", "plan.rotations=cube-24"});
  ASSERT_TRUE(experiment) << experiment.error().message;
  EXPECT_EQ(experiment->plan->options.poses, 9);
  EXPECT_EQ(experiment->plan->options.grid.attitudes.size(), 24U);
}

TEST_F(PlanBlock, TakesChamberTemperaturesInAnyOrderOnceEach) {
  const auto experiment =
      Read("  poses: 12\n  rotations: cube-24\n  temperatures_degc: [60, -20, 25]\n");
  ASSERT_TRUE(experiment) << experiment.error().message;
  EXPECT_EQ(experiment->plan->options.grid.temperatures_degc,
            (std::vector<double>{-20.0, 25.0, 60.0}));
  EXPECT_EQ(experiment->plan->options.grid.attitudes.size(), 24U);
  const auto twice = Read("  poses: 12\n  temperatures_degc: [20, 20, hot]\n");
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message,
              AllOf(HasSubstr("plan.yaml:5: plan.temperatures_degc: a temperature is listed twice"),
                    HasSubstr("plan.temperatures_degc[2]: `hot`")));
}

TEST_F(PlanBlock, RefusesWrongValuesWithTheirLines) {
  const auto experiment = Read(
      "  poses: 0\n  rotations: { spread: 3 }\n  criterion: E\n  start: now\n  rest_s: -1\n"
      "  wanted: { accelerometer.bias: -1 }\n  nominal: { accelerometer: { unit: uT } }\n"
      "  posse: 3\n");
  ASSERT_FALSE(experiment);
  EXPECT_THAT(experiment.error().message,
              AllOf(HasSubstr("plan.yaml:4: plan.poses"),
                    HasSubstr("plan.yaml:5: plan.rotations.spread"),
                    HasSubstr("plan.yaml:6: plan.criterion"),
                    HasSubstr("plan.yaml:7: plan.start"),
                    HasSubstr("plan.yaml:8: plan.rest_s"),
                    HasSubstr("plan.yaml:9: plan.wanted"),
                    HasSubstr("plan.yaml:10: plan.nominal.accelerometer.unit"),
                    HasSubstr("posse")));
}

// What was planned says nothing of what was calibrated.
TEST_F(PlanBlock, IsLeftOutOfTheResolvedExperiment) {
  const auto experiment = Read("  poses: 12\n");
  ASSERT_TRUE(experiment);
  EXPECT_THAT(experiment->resolved_yaml, Not(HasSubstr("plan")));
}

TEST(ShippedPlans, AreReadable) {
  int seen = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(TRUETRIAD_SOURCE_DIR "/configs/plans")) {
    const auto experiment = ReadExperiment(entry.path().string());
    ASSERT_TRUE(experiment) << experiment.error().message;
    EXPECT_TRUE(experiment->plan) << entry.path();
    ++seen;
  }
  EXPECT_GE(seen, 3);
}

}  // namespace plan_test
}  // namespace truetriad
