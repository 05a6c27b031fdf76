// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/sample_units.h"
#include "truetriad/formats/export.h"

// Betaflight and INAV: whole numbers in counts.

namespace truetriad {
namespace counts_test {

using formats_test::RandomUnitCalibration;
using formats_test::WorstDisagreement;
using ::testing::Contains;
using ::testing::HasSubstr;

using Settings = std::map<std::string, std::string>;

Settings CommandLines(const std::string& text) {
  Settings settings;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#' || line == "save") continue;
    EXPECT_EQ(line.substr(0, 4), "set ");
    const std::size_t equals = line.find(" = ");
    settings[line.substr(4, equals - 4)] = line.substr(equals + 3);
  }
  return settings;
}

Export Exported(const Calibration& unit, const std::string& format) {
  const Result<Export> result = ExportCalibration(unit, format);
  EXPECT_TRUE(result) << result.error().message;
  return *result;
}

/// A unit in counts whose offsets and gains are whole numbers of INAV.
Calibration WholeUnit() {
  Calibration unit =
      RandomUnitCalibration({.misaligned = false, .gyro_matrix = false, .counts = true}, 1);
  TriadCalibration& acc = *unit.sensors[Triad::kAccelerometer];
  acc.model.bias = {120.0, -64.0, 301.0};
  acc.model.sensitivity =
      (Eigen::Vector3d(4096.0 / 4000, 4096.0 / 4096, 4096.0 / 4200) / *acc.si_per_count)
          .asDiagonal();
  TriadCalibration& mag = *unit.sensors[Triad::kMagnetometer];
  mag.model.bias = {-33.0, 250.0, 17.0};
  mag.model.sensitivity =
      (Eigen::Vector3d(1000.0 / 1024, 1024.0 / 1024, 1100.0 / 1024) / *mag.si_per_count)
          .asDiagonal();
  return unit;
}

TEST(Inav, AppliesWholeNumbersExactly) {
  const Calibration unit = WholeUnit();
  const Export result = Exported(unit, "inav");
  const Settings settings = CommandLines(result.files[0].text);
  EXPECT_EQ(settings.at("acczero_y"), "-64");
  EXPECT_EQ(settings.at("accgain_x"), "4000");
  EXPECT_EQ(settings.at("magzero_y"), "250");
  EXPECT_EQ(settings.at("maggain_z"), "1100");
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const std::string name = triad == Triad::kAccelerometer ? "acc" : "mag";
    const auto equation = [&](const Eigen::Vector3d& raw, const Eigen::Vector3d&, double) {
      Eigen::Vector3d result_counts;
      for (int axis = 0; axis < 3; ++axis) {
        const double zero = std::stoi(settings.at(name + "zero_" + "xyz"[axis]));
        const double gain = std::stoi(settings.at(name + "gain_" + "xyz"[axis]));
        result_counts[axis] = triad == Triad::kAccelerometer ? (raw[axis] - zero) * gain / 4096.0
                                                             : (raw[axis] - zero) * 1024.0 / gain;
      }
      return Eigen::Vector3d(*unit.sensors[triad]->si_per_count * result_counts);
    };
    EXPECT_LT(WorstDisagreement(unit, triad, equation), 1e-12);
    EXPECT_LT(result.loss[triad]->share(), 1e-12);
  }
}

TEST(Inav, RoundsHalfAwayFromZeroAndStatesTheLoss) {
  Calibration unit = WholeUnit();
  unit.sensors[Triad::kAccelerometer]->model.bias = {120.5, -64.5, 301.0};
  const Export result = Exported(unit, "inav");
  const Settings settings = CommandLines(result.files[0].text);
  EXPECT_EQ(settings.at("acczero_x"), "121");
  EXPECT_EQ(settings.at("acczero_y"), "-65");
  // Half a count on two axes, gains near one.
  const double expected = std::sqrt(0.5) * *unit.sensors[Triad::kAccelerometer]->si_per_count;
  EXPECT_NEAR(result.loss[Triad::kAccelerometer]->largest, expected, 0.05 * expected);
}

TEST(Betaflight, WritesOffsetsOnly) {
  const Export result = Exported(WholeUnit(), "betaflight");
  EXPECT_THAT(result.files[0].text,
              AllOf(HasSubstr("\nset acc_calibration = 120,-64,301,1\n"),
                    HasSubstr("\nset mag_calibration = -33,250,17\nsave\n")));
  EXPECT_THAT(result.notes,
              Contains("accelerometer: dropped: gains and misalignment; offsets only"));
  EXPECT_THAT(result.notes, Contains("gyroscope: dropped: betaflight does not support it"));
  // Gains of 4000 and 4200 of 4096 are dropped.
  EXPECT_NEAR(result.loss[Triad::kAccelerometer]->share(), 104.0 / 4200, 3e-4);
}

TEST(CountsFormats, RefuseReadingsThatAreNoCounts) {
  for (const char* const format : {"betaflight", "inav"}) {
    const Result<Export> result = ExportCalibration(RandomUnitCalibration({}, 1), format);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
    EXPECT_THAT(result.error().message, HasSubstr("calibrate it from a recording in counts"));
  }
}

TEST(CountsFormats, RefuseNumbersThatFirmwareCannotHold) {
  Calibration unit = WholeUnit();
  unit.sensors[Triad::kAccelerometer]->model.bias.z() = 40000.0;
  const Result<Export> offset = ExportCalibration(unit, "betaflight");
  ASSERT_FALSE(offset);
  EXPECT_THAT(offset.error().message, HasSubstr("would be 40000, outside -32768 to 32767"));
  unit = WholeUnit();
  unit.sensors[Triad::kAccelerometer]->model.sensitivity /= 4.0;
  const Result<Export> gain = ExportCalibration(unit, "inav");
  ASSERT_FALSE(gain);
  EXPECT_THAT(gain.error().message, HasSubstr("the accelerometer's gain would be"));
}

TEST(CountsFormats, TakeTheMeanGainWhenTheSizeOfACountIsNotStated) {
  Calibration unit = WholeUnit();
  unit.sensors[Triad::kAccelerometer]->si_per_count.reset();
  const Export result = Exported(unit, "inav");
  EXPECT_THAT(result.notes, Contains(HasSubstr("the size of a count is not stated")));
  EXPECT_LT(result.loss[Triad::kAccelerometer]->share(),
            3e-4);  // gains rounded to 1/4096, offsets whole
}

}  // namespace counts_test
}  // namespace truetriad
