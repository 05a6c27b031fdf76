// SPDX-License-Identifier: Apache-2.0
//
// What a run says of clocks that differ, of a magnet that moved and of a field that changed.

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kConfigs = TRUETRIAD_SOURCE_DIR "/configs/";

class DisturbedRun : public ::testing::Test {
 protected:
  void Simulate(const std::string& scenario) {
    const Finished run = RunTruetriad({"simulate",
                                       "--config=" + kConfigs + "scenarios/" + scenario + ".yaml",
                                       "--output=" + folder_.Path("run")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  Finished CalibrateIt(const std::string& experiment, const std::string& set = "") {
    std::vector<std::string> arguments = {"calibrate",
                                          "--config=" + kConfigs + "experiments/" + experiment,
                                          "--input=" + folder_.Path("run/recording.yaml"),
                                          "--output=" + folder_.Path("result")};
    if (!set.empty()) arguments.push_back("--set=" + set);
    return RunTruetriad(arguments);
  }
  Calibration Result() {
    const auto read = ReadCalibration(folder_.Path("result/calibration.yaml"));
    EXPECT_TRUE(read) << read.error().message;
    return read ? *read : Calibration();
  }

  TemporaryFolder folder_;
};

const ClockOffset* OffsetOf(const Calibration& calibration, Triad triad) {
  for (const ClockOffset& offset : calibration.quality.clock_offsets) {
    if (offset.triad == triad) return &offset;
  }
  return nullptr;
}

// As configs/scenarios/late-magnetometer.yaml has it.
TEST_F(DisturbedRun, FindsByHowMuchTheClocksOfTheSensorsDiffer) {
  Simulate("late-magnetometer");
  const Finished run = CalibrateIt("nine-axis.yaml");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Result();
  EXPECT_THAT(found.messages,
              AllOf(Contains(AllOf(HasSubstr("magnetometer: its times are"),
                                   HasSubstr("later than the gyroscope's"),
                                   HasSubstr("{ magnetometer: { time_offset_s: 0.0"))),
                    Contains(AllOf(HasSubstr("accelerometer: its times are"),
                                   HasSubstr("earlier than the gyroscope's"),
                                   HasSubstr("{ accelerometer: { time_offset_s: -0.0")))));
  for (const auto& [triad, truth_s] :
       {std::pair(Triad::kAccelerometer, -0.035), std::pair(Triad::kMagnetometer, 0.060)}) {
    const ClockOffset* offset = OffsetOf(found, triad);
    ASSERT_NE(offset, nullptr);
    EXPECT_NEAR(offset->later_s, truth_s, 3.0 * offset->sigma_s) << TriadName(triad);
    // A fifth of the time between two readings, or it would say little.
    EXPECT_LT(offset->sigma_s, 0.004) << TriadName(triad);
  }
}

TEST_F(DisturbedRun, TakesAnOffsetOffThatIsStated) {
  Simulate("late-magnetometer");
  const Finished run = CalibrateIt(
      "nine-axis.yaml",
      "sensors.accelerometer.time_offset_s=-0.035,sensors.magnetometer.time_offset_s=0.06");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, Not(HasSubstr("its times are")));
  const Calibration found = Result();
  EXPECT_EQ(found.quality.clock_offsets.size(), 2U);
  for (const ClockOffset& offset : found.quality.clock_offsets) {
    EXPECT_NEAR(offset.later_s, 0.0, 3.0 * offset.sigma_s) << TriadName(offset.triad);
  }
  EXPECT_THAT(found.config_yaml, HasSubstr("time_offset_s: 0.06"));
}

TEST_F(DisturbedRun, SaysThatAMagnetMovedOnTheUnit) {
  Simulate("moved-magnet");
  const Finished run = CalibrateIt("joint.yaml");
  EXPECT_EQ(run.exit_code, 3) << run.out << run.err;
  EXPECT_THAT(
      Result().messages,
      Contains(AllOf(HasSubstr("the magnetometer's readings changed between pose 12 and pose 13"),
                     HasSubstr("its bias differs by"),
                     HasSubstr("iron or a magnet on the unit moves"))));
}

TEST_F(DisturbedRun, SaysThatTheFieldChangedAroundTheUnit) {
  Simulate("changed-field");
  const Finished run = CalibrateIt("joint.yaml");
  EXPECT_EQ(run.exit_code, 3) << run.out << run.err;
  EXPECT_THAT(
      Result().messages,
      Contains(AllOf(HasSubstr("the magnetometer's readings changed between pose 12 and pose 13"),
                     HasSubstr("the field differs by"))));
}

}  // namespace
}  // namespace truetriad
