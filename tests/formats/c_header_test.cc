// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include "formats/sample_units.h"
#include "io/temporary_folder.h"
#include "truetriad/formats/export.h"

namespace truetriad {
namespace c_header_test {

using formats_test::RandomUnitCalibration;
using formats_test::Signal;
using formats_test::Sphere;
using formats_test::UnitKind;
using ::testing::HasSubstr;

constexpr double kFloat32 = 2e-6;

/// Reads "raw force temperature" rows and writes truth, for the three sensors in turn.
constexpr char kProgram[] = R"(#include <stdio.h>
#include "calibration.h"
int main(void) {
  int sensor;
  float raw[3], force[3], temperature, truth[3];
  if (!truetriad_self_test()) return 1;
  while (scanf("%d %f %f %f %f %f %f %f", &sensor, &raw[0], &raw[1], &raw[2], &force[0], &force[1],
               &force[2], &temperature) == 8) {
    if (sensor == 0) truetriad_accelerometer_correct(raw, temperature, truth);
    if (sensor == 1) truetriad_gyroscope_correct(raw, force, temperature, truth);
    if (sensor == 2) truetriad_magnetometer_correct(raw, temperature, truth);
    printf("%.9g %.9g %.9g\n", (double)truth[0], (double)truth[1], (double)truth[2]);
  }
  return 0;
}
)";

int Shell(const std::string& line) {
  const int status = std::system(line.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

struct Row {
  Triad triad;
  float temperature_degc;
  Eigen::Vector3d expected;
};

/// Compiles the header of `unit` with `compiler` and compares what it makes of readings all over
/// the sphere and the temperatures with the calibration.
void ExpectRight(const Calibration& unit, const std::string& compiler, const std::string& source) {
  const Result<Export> result = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(result) << result.error().message;
  const TemporaryFolder folder;
  folder.Write("calibration.h", result->files[0].text);
  folder.Write(source, kProgram);
  const std::string program = folder.Path("program");
  ASSERT_EQ(Shell(compiler + " -Wall -Wextra -Werror -pedantic -O1 -o " + program + " " +
                  folder.Path(source) + " >" + folder.Path("log") + " 2>&1"),
            0)
      << TemporaryFolder::Read(folder.Path("log"));
  std::vector<Row> rows;
  std::ofstream input(folder.Path("input"));
  input.precision(9);
  for (const Triad triad : kTriads) {
    const TriadCalibration& sensor = *unit.sensors[triad];
    for (const float temperature : {-20.0F, -3.0F, 25.0F, 41.5F, 70.0F}) {
      const TriadModel<double> model =
          sensor.thermal ? ModelAtTemperature(sensor.model, *sensor.thermal, temperature)
                         : sensor.model;
      const std::vector<Eigen::Vector3d> sphere = Sphere();
      for (std::size_t i = 0; i < sphere.size(); ++i) {
        const Eigen::Vector3f force = (9.8 * sphere[(7 * i + 1) % sphere.size()]).cast<float>();
        Eigen::Vector3d offset = Eigen::Vector3d::Zero();
        if (sensor.g_sensitivity) offset = *sensor.g_sensitivity * force.cast<double>();
        const Eigen::Vector3f raw =
            (model.RawFromTruth(Signal(triad) * sphere[i]) + offset).cast<float>();
        input << static_cast<int>(triad) << ' ' << raw.transpose() << ' ' << force.transpose()
              << ' ' << temperature << '\n';
        rows.push_back({triad, temperature, model.TruthFromRaw(raw.cast<double>() - offset)});
      }
    }
  }
  input.close();
  ASSERT_EQ(Shell(program + " <" + folder.Path("input") + " >" + folder.Path("output")), 0)
      << "the header's own test failed";
  std::ifstream output(folder.Path("output"));
  double worst = 0.0;
  for (const Row& row : rows) {
    Eigen::Vector3d truth;
    ASSERT_TRUE(output >> truth.x() >> truth.y() >> truth.z());
    worst = std::max(worst, (truth - row.expected).norm() / Signal(row.triad));
  }
  EXPECT_LT(worst, kFloat32);
}

constexpr UnitKind kWholeUnit = {.bias_order = 3, .matrix_order = 2, .g_sensitivity = true};

TEST(CHeader, CompiledAsC99CorrectsAsTheCalibrationDoes) {
  ExpectRight(RandomUnitCalibration(kWholeUnit, 1), "gcc -std=c99", "program.c");
}

TEST(CHeader, CompiledAsCppCorrectsAsTheCalibrationDoes) {
  ExpectRight(RandomUnitCalibration(kWholeUnit, 2), "g++ -std=c++11", "program.cc");
}

TEST(CHeader, HoldsAnyUnit) {
  ExpectRight(RandomUnitCalibration({}, 3), "gcc -std=c99", "program.c");
  ExpectRight(RandomUnitCalibration({.counts = true}, 4), "gcc -std=c99", "program.c");
  ExpectRight(
      RandomUnitCalibration({.bias_order = 7, .counts = true}, 5), "gcc -std=c99", "program.c");
  ExpectRight(RandomUnitCalibration({.matrix_order = 3}, 6), "gcc -std=c99", "program.c");
}

TEST(CHeader, NoticesAChangedNumber) {
  Calibration unit = RandomUnitCalibration({}, 7);
  unit.sensors[Triad::kAccelerometer]->model.bias.x() = 0.5;
  const Result<Export> result = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(result);
  std::string text = result->files[0].text;
  const std::size_t at = text.find("{0.5f");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 5, "{0.50000006f");  // one step of float32: the test vectors do not see it
  const TemporaryFolder folder;
  folder.Write("calibration.h", text);
  folder.Write("program.c", kProgram);
  ASSERT_EQ(Shell("gcc -std=c99 -o " + folder.Path("program") + " " + folder.Path("program.c")), 0);
  EXPECT_EQ(Shell(folder.Path("program") + " </dev/null"), 1);
}

TEST(CHeader, KeepsACommentACommentWhateverTheSerialNumberIs) {
  Calibration unit = RandomUnitCalibration({}, 8);
  unit.serial = "a */ int broken( /* \n#error";
  const Result<Export> result = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(result);
  const TemporaryFolder folder;
  folder.Write("calibration.h", result->files[0].text);
  folder.Write("program.c", kProgram);
  EXPECT_EQ(Shell("gcc -std=c99 -o " + folder.Path("program") + " " + folder.Path("program.c")), 0);
}

}  // namespace c_header_test
}  // namespace truetriad
