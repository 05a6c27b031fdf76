// SPDX-License-Identifier: Apache-2.0
#include "io/applied_correction.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/LU>

namespace truetriad {
namespace {

constexpr std::string_view kUnknown =
    "the corrections already applied to these readings are unknown, so a calibration could be "
    "wrong by as much; find out and state them (docs/recordings.md), or state `none` if the "
    "readings are raw";

void ReadMatrix(YamlReader yaml, Eigen::Matrix3d* matrix) {
  std::vector<YamlReader> rows = yaml.Items();
  if (rows.size() != 3) {
    yaml.Fail("expected three rows of three numbers");
    return;
  }
  for (int row = 0; row < 3; ++row) {
    Eigen::Vector3d values;
    if (rows[static_cast<std::size_t>(row)].Read(&values)) matrix->row(row) = values.transpose();
  }
}

AppliedCorrection::Thermal ReadThermal(YamlReader yaml) {
  AppliedCorrection::Thermal thermal;
  yaml.Require("reference_degc", &thermal.reference_degc);
  std::vector<double> range;
  if (yaml.Require("range_degc", &range)) {
    if (range.size() != 2 || !(range[0] < range[1])) {
      yaml.Child("range_degc").Fail("expected the lowest and the highest temperature: [lo, hi]");
    } else {
      thermal.low_degc = range[0];
      thermal.high_degc = range[1];
    }
  }
  for (YamlReader& item : yaml.RequireChild("coefficients").Items()) {
    Eigen::Vector3d coefficient = Eigen::Vector3d::Zero();
    item.Read(&coefficient);
    thermal.coefficients.push_back(coefficient);
  }
  double calibrated_degc = 0.0;
  if (yaml.Optional("calibrated_degc", &calibrated_degc)) {
    thermal.at_calibration = thermal.At(calibrated_degc);
  }
  yaml.RejectUnknown();
  return thermal;
}

}  // namespace

Eigen::Vector3d AppliedCorrection::Thermal::At(double temperature_degc) const {
  // Outside of its range the firmware holds the correction.
  const double tau = std::min(std::max(temperature_degc, low_degc), high_degc) - reference_degc;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto coefficient = coefficients.rbegin(); coefficient != coefficients.rend();
       ++coefficient) {
    sum = (sum + *coefficient) * tau;
  }
  return sum;
}

std::optional<AppliedCorrection> ReadAppliedCorrection(YamlReader yaml) {
  if (!yaml) return std::nullopt;
  if (!yaml.IsMap()) {
    std::string text;
    if (yaml.Read(&text) && text != "none") {
      yaml.Fail(text == "unknown"
                    ? std::string(kUnknown)
                    : "`" + text + "` is neither none, unknown nor a map of corrections");
    }
    return std::nullopt;
  }
  AppliedCorrection applied;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  yaml.Optional("offset", &applied.offset);
  yaml.Optional("scale", &scale);
  if (YamlReader rows = yaml.Child("matrix")) ReadMatrix(rows, &matrix);
  if (YamlReader thermal = yaml.Child("thermal")) applied.thermal = ReadThermal(thermal);
  yaml.RejectUnknown();
  const Eigen::Matrix3d correction = matrix * scale.asDiagonal();
  // A correction is near a rotation, with gains near one of whatever unit: far from this is a
  // typing error, and undoing it would make noise of the readings.
  constexpr double kSmallestDeterminant = 1e-3;
  const double size = correction.norm() / std::sqrt(3.0);
  if (!(std::abs(correction.determinant()) > kSmallestDeterminant * size * size * size)) {
    yaml.Fail("scale and matrix cannot be undone, because together they are singular or nearly so");
    return std::nullopt;
  }
  applied.inverse = correction.inverse();
  return applied;
}

}  // namespace truetriad
