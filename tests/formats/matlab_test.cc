// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/matlab_values.h"
#include "formats/sample_units.h"
#include "truetriad/formats/export.h"

namespace truetriad {
namespace matlab_test {

using formats_test::RandomUnitCalibration;
using formats_test::WorstDisagreement;
using ::testing::HasSubstr;

constexpr double kDouble = 1e-12;

/// The matrix that `name = […];` of a script holds.
Eigen::Matrix3d ScriptMatrix(const std::string& text, const std::string& name) {
  const std::size_t at = text.find("\n" + name + " = [");
  EXPECT_NE(at, std::string::npos) << name;
  const std::size_t begin = text.find('[', at) + 1;
  std::istringstream rows(text.substr(begin, text.find(']', begin) - begin));
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  std::string row;
  for (int i = 0; std::getline(rows, row, ';'); ++i) {
    std::istringstream numbers(row);
    for (int j = 0; j < 3; ++j) numbers >> matrix(i, j);
  }
  return matrix;
}

TEST(Matlab, ScriptAppliesTheCalibrationExactly) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration unit = RandomUnitCalibration({.g_sensitivity = true}, seed);
    ExportOptions options;
    options.file_name = "unit.m";
    const Result<Export> result = ExportCalibration(unit, "matlab", options);
    ASSERT_TRUE(result) << result.error().message;
    const std::string& text = result->files[0].text;
    const Eigen::Matrix3d C = ScriptMatrix(text, "gyro.C");
    const Eigen::Matrix3d G = ScriptMatrix(text, "gyro.G");
    const Eigen::Vector3d b = ScriptMatrix(text, "gyro.b").col(0);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kGyroscope,
                                [&](const auto& y, const auto& f, double) -> Eigen::Vector3d {
                                  return C * (y - b - G * f);
                                }),
              kDouble);
    // magcal: rows.
    const Eigen::Matrix3d A = ScriptMatrix(text, "A");
    const Eigen::RowVector3d row = ScriptMatrix(text, "b").row(0);
    EXPECT_LT(WorstDisagreement(unit,
                                Triad::kMagnetometer,
                                [&](const auto& y, const auto&, double) -> Eigen::Vector3d {
                                  return ((y.transpose() - row) * A).transpose();
                                }),
              kDouble);
    EXPECT_THAT(text, HasSubstr("\nexpmfs = 48;\n"));
  }
}

#ifdef TRUETRIAD_HAVE_MATIO
TEST(Matlab, BinaryHoldsTheSameBits) {
  const Calibration unit = RandomUnitCalibration({}, 1);
  const Result<Export> result = ExportCalibration(unit, "matlab");
  ASSERT_TRUE(result) << result.error().message;
  const std::string& bytes = result->files[0].text;
  EXPECT_EQ(bytes.substr(0, 19), "MATLAB 5.0 MAT-file");
  const Result<MatlabVariables> variables = MatlabModuleOf()->parse(bytes, "unit.mat");
  ASSERT_TRUE(variables) << variables.error().message;
  const TriadModel<double>& accel = unit.sensors[Triad::kAccelerometer]->model;
  const MatlabVariable* const S = FindVariable(*variables, "accel.S");
  ASSERT_NE(S, nullptr);
  EXPECT_EQ(S->numbers, accel.sensitivity);
  EXPECT_EQ(FindVariable(*variables, "accel.b")->numbers, Eigen::MatrixXd(accel.bias));
  EXPECT_EQ(FindVariable(*variables, "accel.input_unit")->text, "m/s^2");
  EXPECT_EQ(FindVariable(*variables, "expmfs")->numbers(0, 0), 48.0);
  EXPECT_THAT(FindVariable(*variables, "comment")->text, HasSubstr("error of at most"));
}

TEST(Matlab, RefusesADamagedFile) {
  const Result<MatlabVariables> variables =
      MatlabModuleOf()->parse("MATLAB 5.0 MAT-file, cut", "unit.mat");
  ASSERT_FALSE(variables);
  EXPECT_EQ(variables.error().kind(), ErrorKind::kBadInput);
}
#endif

TEST(Matlab, ScriptsOfPeopleAreRead) {
  const MatlabVariables variables = ParseScript(
      "% A = [1 2];\nA = [1, 2, 3\n4 5 6];  % a new line, a new row\n"
      "mag.input_unit = '50% T'; x=-1e-3;\ny = x + 1;\nb = [1;2;\n3];");
  ASSERT_NE(FindVariable(variables, "A"), nullptr);
  EXPECT_EQ(FindVariable(variables, "A")->numbers, Eigen::MatrixXd({{1, 2, 3}, {4, 5, 6}}));
  ASSERT_NE(FindVariable(variables, "b"), nullptr);
  EXPECT_EQ(FindVariable(variables, "b")->numbers, Eigen::MatrixXd(Eigen::Vector3d(1, 2, 3)));
  EXPECT_EQ(FindVariable(variables, "x")->numbers(0, 0), -1e-3);
  EXPECT_EQ(FindVariable(variables, "mag.input_unit")->text, "50% T");
  EXPECT_EQ(FindVariable(variables, "y"), nullptr);
}

}  // namespace matlab_test
}  // namespace truetriad
