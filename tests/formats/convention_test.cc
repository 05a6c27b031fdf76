// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "formats/format.h"

namespace truetriad {
namespace {

/// Quantities that state a whole correction together, for a matrix of this form.
struct Statement {
  enum class Form { kFull, kLower, kSymmetric } form = Form::kFull;
  bool has_g_sensitivity = false;
  std::vector<Quantity> quantities;
};

const std::vector<Statement>& Statements() {
  using enum Quantity;
  using enum Statement::Form;
  static const auto& statements = *new std::vector<Statement>{
      {kFull, false, {kCorrection, kBias}},
      {kFull, false, {kCorrectionByColumn, kBiasAfter}},
      {kFull, false, {kMisalignment, kGainsMatrix, kBias}},
      {kFull, false, {kMisalignment, kGains, kBiasAdded}},
      {kFull, false, {kDeviation, kBiasAfter}},
      {kLower, false, {kLowerDeviation, kBiasAfter}},
      {kSymmetric, false, {kDiagonal, kOffDiagonal, kBias}},
      {kFull, true, {kSensitivity, kBias, kGSensitivity}},
      {kFull, true, {kLowerFactor, kRotationFactor, kGBehindRotation, kBias}}};
  return statements;
}

TriadCalibration UnitFor(const Statement& statement) {
  TriadCalibration sensor;
  Eigen::Matrix3d& S = sensor.model.sensitivity;
  S << 1.02, 0.01, -0.02, 0.03, 0.97, 0.015, -0.012, 0.022, 1.05;
  if (statement.form == Statement::Form::kLower) S = S.triangularView<Eigen::Lower>();
  if (statement.form == Statement::Form::kSymmetric) S = (0.5 * (S + S.transpose())).eval();
  sensor.model.bias = {0.3, -0.2, 0.1};
  if (statement.has_g_sensitivity) {
    Eigen::Matrix3d& G = sensor.g_sensitivity.emplace();
    G << 0.001, 0.002, -0.003, 0.0004, 0.005, 0.006, -0.007, 0.008, 0.009;
  }
  return sensor;
}

TEST(Conventions, MakeOneCorrectionOfEveryStatementOfIt) {
  const Eigen::Vector3d reading(9.1, -2.3, 4.7), force(1.0, -9.0, 3.0);
  for (std::size_t i = 0; i < Statements().size(); ++i) {
    SCOPED_TRACE(i);
    const Statement& statement = Statements()[i];
    const TriadCalibration sensor = UnitFor(statement);
    Stated stated;
    for (const Quantity quantity : statement.quantities) {
      stated[quantity] = ValueOf(quantity, sensor);
      EXPECT_EQ(stated[quantity].size(), SizeOf(quantity));
    }
    const CorrectionParts parts = CorrectionParts::Of(stated);
    Eigen::Vector3d raw = reading - sensor.model.bias;
    if (sensor.g_sensitivity) raw -= *sensor.g_sensitivity * force;
    const Eigen::Vector3d truth = sensor.model.Correction() * raw;
    // Some twenty roundings of numbers up to ten; of float32 in the second.
    EXPECT_LT((EquationOf(parts, Arithmetic::kFloat64)(reading, force, 25.0) - truth).norm(),
              1e-13);
    EXPECT_LT((EquationOf(parts, Arithmetic::kFloat32)(reading, force, 25.0) - truth).norm(), 1e-5);
    if (statement.quantities.back() == Quantity::kBiasAfter) continue;  // States no b.
    if (stated.contains(Quantity::kGains)) continue;  // Of Fusion, which is not imported.
    const TriadCalibration read = TriadOf(parts, "m/s^2", "m/s^2");
    EXPECT_TRUE(read.model.sensitivity.isApprox(sensor.model.sensitivity, 1e-14));
    EXPECT_EQ(read.model.bias, sensor.model.bias);
  }
}

}  // namespace
}  // namespace truetriad
