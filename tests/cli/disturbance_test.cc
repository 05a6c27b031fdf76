// SPDX-License-Identifier: Apache-2.0
//
// What a run says of clocks that differ, of a magnet that moved and of a field that changed.

#include <cmath>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/finding_matchers.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace disturbance_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kConfigs = TRUETRIAD_SOURCE_DIR "/configs/";

class DisturbedRun : public ::testing::Test {
 protected:
  void Simulate(const std::string& scenario, const std::string& set = "") {
    std::vector<std::string> arguments = {
        "simulate",
        "--config=" + kConfigs + "scenarios/" + scenario + ".yaml",
        "--output=" + folder_.Path("run")};
    if (!set.empty()) arguments.push_back("--set=" + set);
    const Finished run = RunTruetriad(arguments);
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
  for (const ClockOffset& offset : calibration.quality.rests.clock_offsets) {
    if (offset.triad == triad) return &offset;
  }
  return nullptr;
}

// As configs/scenarios/late-magnetometer.yaml has it.
TEST_F(DisturbedRun, CorrectsTheClocksOfTheSensors) {
  Simulate("late-magnetometer");
  const Finished run = CalibrateIt("nine-axis.yaml");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Result();
  EXPECT_THAT(found.findings, Not(Contains(HasCode(FindingCode::kClockOffset))));
  PosesConfig clocks;
  TakeClocks(found, &clocks);
  const PerTriad<double>& taken_off_s = clocks.time_offset_s;
  for (const auto& [triad, truth_s] :
       {std::pair(Triad::kAccelerometer, -0.035), std::pair(Triad::kMagnetometer, 0.060)}) {
    EXPECT_THAT(found.findings,
                Contains(AllOf(HasCode(FindingCode::kClockCorrected),
                               IsAbout(triad),
                               ::testing::Field(&Finding::treatment, Treatment::kCorrected))));
    const ClockOffset* left = OffsetOf(found, triad);
    ASSERT_NE(left, nullptr);
    EXPECT_NEAR(left->later_s, 0.0, 3.0 * left->sigma_s) << TriadName(triad);
    EXPECT_NEAR(taken_off_s[triad], truth_s, 3.0 * left->sigma_s) << TriadName(triad);
  }
}

TEST_F(DisturbedRun, FindsByHowMuchTheClocksOfTheSensorsDiffer) {
  Simulate("late-magnetometer");
  const Finished run = CalibrateIt("nine-axis.yaml", "clocks=as_stated");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Result();
  // One block, ready to paste.
  const auto is_late = HasCode(FindingCode::kClockOffset);
  const auto is_widened = ::testing::Field(&Finding::treatment, Treatment::kWidened);
  EXPECT_THAT(found.findings,
              AllOf(Contains(AllOf(is_late, is_widened, IsAbout(Triad::kAccelerometer))),
                    Contains(AllOf(is_late, is_widened, IsAbout(Triad::kMagnetometer))),
                    Contains(Says(ContainsRegex(
                        "set `sensors: \\{ accelerometer: \\{ time_offset_s: -0\\.03[0-9]* \\}, "
                        "magnetometer: \\{ time_offset_s: 0\\.0[0-9]* \\} \\}`")))));
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
  const Finished run = CalibrateIt("nine-axis.yaml",
                                   "clocks=as_stated,sensors.accelerometer.time_offset_s=-0.035,"
                                   "sensors.magnetometer.time_offset_s=0.06");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, Not(HasSubstr("its times are")));
  const Calibration found = Result();
  EXPECT_EQ(found.quality.rests.clock_offsets.size(), 2U);
  for (const ClockOffset& offset : found.quality.rests.clock_offsets) {
    EXPECT_NEAR(offset.later_s, 0.0, 3.0 * offset.sigma_s) << TriadName(offset.triad);
  }
  EXPECT_THAT(found.config_yaml, HasSubstr("time_offset_s: 0.06"));
}

class RunWithALateSensor : public DisturbedRun, public ::testing::WithParamInterface<double> {
 protected:
  void ExpectMagnetometerIsRight() const {
    const Finished compared = RunTruetriad({"compare",
                                            "--a=" + folder_.Path("result/calibration.yaml"),
                                            "--b=" + folder_.Path("run/truth.yaml")});
    // Twelve numbers: at 4 σ chance spoils one such run in 1300.
    std::istringstream lines(compared.out);
    int judged = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.find("  magnetometer.") != 0) continue;
      ++judged;
      const double sigmas = std::strtod(line.substr(line.find_last_of(' ')).c_str(), nullptr);
      EXPECT_LT(sigmas, 4.0) << line;
    }
    EXPECT_EQ(judged, 12) << compared.out;
  }
};

// Rests of 3.4 to 4.6 s, less what the turns take of their ends: at half a second and more turns
// reach into the magnetometer's rests, at half a rest it sees other rests.
TEST_P(RunWithALateSensor, IsRightUnlessClocksAreToBeAsStated) {
  const double late_s = GetParam();
  std::ostringstream late_ms;
  late_ms << 1e3 * late_s;
  Simulate("late-magnetometer",
           "sensors.accelerometer.sampling.clock_offset_ms=0,"
           "sensors.magnetometer.sampling.clock_offset_ms=" +
               late_ms.str());
  const Finished run = CalibrateIt("nine-axis.yaml", "clocks=as_stated");
  // Where it sees other rests nothing can be said; a shorter lag is in σ.
  const bool sees_other_rests = std::abs(late_s) >= 2.0;
  EXPECT_EQ(run.exit_code, sees_other_rests ? 3 : 0) << run.out << run.err;
  if (!sees_other_rests) ExpectMagnetometerIsRight();
  const Calibration found = Result();
  std::string stated;
  for (const Finding& finding : found.findings) {
    std::smatch match;
    const std::regex block("sensors: \\{ magnetometer: \\{ time_offset_s: (-?[0-9.]+) \\} \\}");
    if (std::regex_search(finding.remedy, match, block)) stated = match[1];
  }
  ASSERT_FALSE(stated.empty()) << run.out;
  // Half of the step in which it is said.
  EXPECT_NEAR(std::stod(stated), late_s, 0.05);

  const Finished again = CalibrateIt("nine-axis.yaml");
  ASSERT_EQ(again.exit_code, 0) << again.out << again.err;
  const Calibration corrected = Result();
  const ClockOffset* left = OffsetOf(corrected, Triad::kMagnetometer);
  ASSERT_NE(left, nullptr);
  PosesConfig clocks;
  TakeClocks(corrected, &clocks);
  EXPECT_NEAR(clocks.time_offset_s[Triad::kMagnetometer], late_s, 4.0 * left->sigma_s);
  EXPECT_THAT(again.out, Not(HasSubstr("change within")));
  ExpectMagnetometerIsRight();
}

INSTANTIATE_TEST_SUITE_P(Offsets,
                         RunWithALateSensor,
                         ::testing::Values(0.6, -0.6, 1.0, -1.0, 2.0, -2.0, 5.0, -5.0),
                         [](const auto& tested) {
                           const double late_s = tested.param;
                           return std::string(late_s > 0.0 ? "Late" : "Early") +
                                  std::to_string(std::lround(1e3 * std::abs(late_s))) + "Ms";
                         });

TEST_F(DisturbedRun, IsEvaluatedWithTheClocksOfItsCalibration) {
  Simulate("late-magnetometer",
           "sensors.accelerometer.sampling.clock_offset_ms=0,"
           "sensors.magnetometer.sampling.clock_offset_ms=1000");
  ASSERT_EQ(CalibrateIt("nine-axis.yaml", "clocks=as_stated,sensors.magnetometer.time_offset_s=1")
                .exit_code,
            0);
  const Finished run = RunTruetriad({"evaluate",
                                     "--calibration=" + folder_.Path("result/calibration.yaml"),
                                     "--input=" + folder_.Path("run/recording.yaml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("magnetometer: 1 s subtracted from its times"));
  EXPECT_THAT(run.out, Not(HasSubstr("its readings")));
}

// Readings that are neither noisy nor rounded: σ next to nothing beside those that are stated.
TEST_F(DisturbedRun, WithoutAnyNoiseIsStillDetermined) {
  Simulate("consumer-9dof",
           "seed=4,sensors.accelerometer.noise=none,sensors.accelerometer.resolution_mg=0,"
           "sensors.gyroscope.noise=none,sensors.gyroscope.resolution_degps=0,"
           "sensors.magnetometer.noise=none,sensors.magnetometer.resolution_ut=0");
  for (const std::string experiment :
       {"accelerometer-only.yaml", "magnetometer-only.yaml", "joint.yaml", "nine-axis.yaml"}) {
    const Finished run = CalibrateIt(experiment);
    ASSERT_EQ(run.exit_code, 0) << experiment << run.out << run.err;
    const Calibration found = Result();
    if (found.sensors[Triad::kMagnetometer]) {
      EXPECT_THAT(found.findings,
                  Contains(AllOf(HasCode(FindingCode::kNoiseFree), IsAbout(Triad::kMagnetometer))));
    }
  }
  // As the file has it; the accelerometer creeps by its temperature, the magnetometer by nothing.
  const Eigen::Vector3d bias_ut(12.4, -31.0, 7.7);
  EXPECT_LT((Result().sensors[Triad::kMagnetometer]->model.bias - bias_ut).norm(), 1e-3);
}

// Steps of 20 σ: rests show the bias to half a step, turns show it better.
TEST_F(DisturbedRun, ACoarseGyroscopeIsOffByWhatItsSigmaSays) {
  const Eigen::Vector3d bias = kRadPerDeg * Eigen::Vector3d(0.63, -0.34, 0.23);
  const double step = 1.0 * kRadPerDeg;
  for (const int seed : {1, 2, 3, 4}) {
    Simulate("consumer-9dof",
             "seed=" + std::to_string(seed) + ",sensors.gyroscope.resolution_degps=1");
    const Finished run = CalibrateIt("nine-axis.yaml");
    ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
    const Calibration found = Result();
    int faults = 0;
    for (const Finding& finding : found.findings) {
      if (finding.code != FindingCode::kFault) continue;
      ++faults;
      EXPECT_THAT(finding.text, HasSubstr("coarser than its noise"));
    }
    EXPECT_EQ(faults, 1);
    const TriadCalibration& gyroscope = *found.sensors[Triad::kGyroscope];
    const Eigen::Array3d off = (gyroscope.model.bias - bias).array() / gyroscope.bias_sigma.array();
    EXPECT_LT(off.abs().maxCoeff(), 4.0) << seed;
    EXPECT_LT(gyroscope.bias_sigma.maxCoeff(), step / std::sqrt(12.0));
  }
}

TEST_F(DisturbedRun, LeavesOutARestInWhichAMagnetPasses) {
  Simulate("disturbed");
  const Finished run = CalibrateIt("nine-axis.yaml");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(Result().findings,
              Contains(AllOf(HasCode(FindingCode::kMovingReadings),
                             IsAbout(Triad::kMagnetometer),
                             Says(HasSubstr("(9)")))));
}

TEST_F(DisturbedRun, SaysThatAMagnetMovedOnTheUnit) {
  Simulate("moved-magnet");
  const Finished run = CalibrateIt("joint.yaml", "device.serial=A0007");
  // σ hold it, and the limits that joint.yaml states are met.
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Result();
  const Finding* change = Find(found.findings, FindingCode::kFault);
  ASSERT_NE(change, nullptr);
  EXPECT_EQ(change->pose, 13);
  EXPECT_THAT(change->text, StartsWith("magnetometer: bias step"));
  // A line may want such units recorded again, whatever their limits.
  const Finished strict = CalibrateIt("joint.yaml", "device.serial=A0007,strict=true");
  EXPECT_EQ(strict.exit_code, 3) << strict.out << strict.err;
  EXPECT_THAT(Result().findings,
              Contains(AllOf(HasCode(FindingCode::kFault),
                             ::testing::Property(&Finding::IsRefusal, true))));
  EXPECT_EQ(CalibrateIt("joint.yaml", "device.serial=A0007,strict=1e6").exit_code, 0);
}

TEST_F(DisturbedRun, SaysThatTheFieldChangedAroundTheUnit) {
  Simulate("changed-field");
  const Finished run = CalibrateIt("joint.yaml", "device.serial=A0008");
  // Corrected, and within the limits that joint.yaml states.
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Result();
  const Finding* change = Find(found.findings, FindingCode::kFault);
  ASSERT_NE(change, nullptr);
  EXPECT_EQ(change->pose, 13);
  EXPECT_THAT(change->text, HasSubstr("magnetometer: field step"));
}

}  // namespace disturbance_test
}  // namespace truetriad
