// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/formats/export.h"

// The text that every format writes of one unit, so that a change shows as a difference to be
// reviewed. To take new texts over: TRUETRIAD_UPDATE_GOLDEN=1 build/tests/formats/… and look at
// the difference.

namespace truetriad {
namespace golden_test {

/// A unit in counts of known size, with terms of every kind.
Calibration GoldenUnit() {
  Calibration unit;
  unit.serial = "SN0042";
  unit.model = "golden";
  unit.software_version = "0.1.0";
  unit.created = "2026-01-31T12:00:00Z";
  unit.inputs = {{"recording.csv", std::string(64, '0'), 6000}};
  unit.outcome = Outcome::kConverged;
  unit.within_limits = true;
  unit.reference.field_ut = 48.0;
  unit.reference.dip_rad = 1.1;
  unit.quality.poses = 24;
  unit.quality.effective_dof = 40.0;
  const auto add = [&unit](Triad triad, double counts_per_si) -> TriadCalibration& {
    TriadCalibration& sensor = unit.sensors[triad].emplace();
    sensor.input_unit = "counts";
    sensor.output_unit = TruthUnitName(triad);
    sensor.si_per_count = 1.0 / counts_per_si;
    return sensor;
  };
  TriadCalibration& accel = add(Triad::kAccelerometer, 208.0);
  accel.model.bias = {64.25, -25.5, 46.0};
  accel.model.sensitivity << 210.7, 0, 0, 1.25, 206.1, 0, -1.9, 0.8, 209.2;
  accel.bias_sigma = {0.1, 0.1, 0.12};
  accel.sensitivity_sigma << 0.015, 0, 0, 0.02, 0.014, 0, 0.02, 0.02, 0.016;
  accel.thermal = ThermalTerms{};
  accel.thermal->reference_degc = 25.0;
  accel.thermal->range_degc = {-10.0, 60.0};
  accel.thermal->bias = {{0.25, -0.125, 0.5}, {0.002, 0.001, -0.003}};
  accel.thermal->sensitivity = {Eigen::Matrix3d(Eigen::Vector3d(0.01, 0.02, -0.01).asDiagonal())};
  TriadCalibration& gyro = add(Triad::kGyroscope, 940.0);
  gyro.model.bias = {10.5, -5.75, 3.8};
  gyro.model.sensitivity << 949.4, 3.8, -5.6, 1.9, 930.6, 4.7, -2.8, 6.6, 943.8;
  gyro.g_sensitivity = 0.01 * Eigen::Matrix3d::Identity();
  TriadCalibration& mag = add(Triad::kMagnetometer, 6.5);
  mag.model.bias = {80.6, -201.5, 50.05};
  mag.model.sensitivity << 6.89, 0.14, -0.08, 0.05, 6.17, 0.22, 0.17, -0.12, 6.63;
  unit.covariance.parameters = {"accelerometer.bias.x"};
  unit.covariance.matrix = Eigen::MatrixXd::Constant(1, 1, 0.01);
  return unit;
}

/// Words and numbers; the stated loss, which is rounding where nothing is lost, is left out.
std::vector<std::string> Tokens(const std::string& text) {
  std::vector<std::string> tokens;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("error of at most") != std::string::npos) continue;
    std::string token;
    for (const char c : line) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '+' ||
          c == '_') {
        token += c;
        continue;
      }
      if (!token.empty()) tokens.push_back(std::exchange(token, ""));
      if (c != ' ') tokens.emplace_back(1, c);
    }
    if (!token.empty()) tokens.push_back(token);
    tokens.emplace_back("\n");
  }
  return tokens;
}

/// The same word, or numbers that differ by rounding alone.
bool Same(const std::string& a, const std::string& b, double tolerance) {
  if (a == b) return true;
  char* end_a = nullptr;
  char* end_b = nullptr;
  const double number_a = std::strtod(a.c_str(), &end_a);
  const double number_b = std::strtod(b.c_str(), &end_b);
  if (end_a == a.c_str() || end_b == b.c_str() || std::string(end_a) != end_b) return false;
  return std::abs(number_a - number_b) <= tolerance * std::max(std::abs(number_a), 1e-3);
}

class Golden : public ::testing::TestWithParam<std::string> {};

TEST_P(Golden, TextIsWhatItWas) {
  const std::string format(GetParam().substr(0, GetParam().find('.')));
  ExportOptions options;
  options.software_version = "0.1.0";
  options.file_name = GetParam();
  setenv("SOURCE_DATE_EPOCH", "1769860800", 1);
  const Result<Export> result = ExportCalibration(GoldenUnit(), format, options);
  unsetenv("SOURCE_DATE_EPOCH");
  ASSERT_TRUE(result) << result.error().message;
  for (const ExportedFile& file : result->files) {
    const std::string path =
        TRUETRIAD_SOURCE_DIR "/tests/formats/golden/" + GetParam() + file.suffix;
    if (std::getenv("TRUETRIAD_UPDATE_GOLDEN") != nullptr) {
      std::ofstream(path, std::ios::binary) << file.text;
      continue;
    }
    const std::vector<std::string> expected = Tokens(TemporaryFolder::Read(path));
    const std::vector<std::string> found = Tokens(file.text);
    ASSERT_EQ(expected.size(), found.size()) << path;
    // Two units in the last place of float32; in double, what another order of sums may change.
    constexpr double kFloat32 = 2.4e-7;
    constexpr double kDouble = 1e-12;
    for (std::size_t i = 0; i < found.size(); ++i) {
      bool is_float = false;
      for (const FormatInfo& info : Formats()) {
        if (info.name == format) is_float = info.arithmetic == Arithmetic::kFloat32;
      }
      ASSERT_TRUE(Same(expected[i], found[i], is_float ? kFloat32 : kDouble))
          << path << ": `" << expected[i] << "` became `" << found[i] << "`";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfEach,
                         Golden,
                         ::testing::Values("px4.params",
                                           "ardupilot.param",
                                           "betaflight.txt",
                                           "inav.txt",
                                           "kalibr.yaml",
                                           "kalibr-result.yaml",
                                           "openvins.yaml",
                                           "basalt.json",
                                           "imu-tk",
                                           "imu-calib.yaml",
                                           "realsense.json",
                                           "fusion.h",
                                           "ros2.yaml",
                                           "matlab.m",
                                           "json.json",
                                           "record.json",
                                           "c-header.h"),
                         [](const auto& test) {
                           std::string name = test.param;
                           for (char& c : name) {
                             if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
                           }
                           return name;
                         });

}  // namespace golden_test
}  // namespace truetriad
