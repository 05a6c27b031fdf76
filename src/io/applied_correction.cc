// SPDX-License-Identifier: Apache-2.0
#include "io/applied_correction.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/LU>

#include "io/field_schema.h"

namespace truetriad {
namespace {

constexpr std::string_view kUnknown =
    "the corrections already applied to these readings are unknown, so a calibration could be "
    "wrong by the size of these corrections; find out and state them (docs/recordings.md), or "
    "state "
    "`none` if the readings are raw";

void ThermalFields(auto& visit, AppliedCorrection::Thermal& thermal) {
  for (const char* key : {"reference_degc", "range_degc", "coefficients"}) visit.Require(key);
  visit("reference_degc", thermal.reference_degc, kAnyNumber);
  if (std::vector<double> range; visit("range_degc", range, NumberList())) {
    const bool is_range = range.size() == 2 && range[0] < range[1];
    visit.Expect(
        is_range, "expected the lowest and the highest temperature: [lo, hi]", "range_degc");
    thermal.low_degc = is_range ? range[0] : 0.0;
    thermal.high_degc = is_range ? range[1] : 0.0;
  }
  visit("coefficients", thermal.coefficients, ListOf{kNumbers});
  if (double degc = 0.0; visit("calibrated_degc", degc, kAnyNumber)) {
    thermal.at_calibration = thermal.At(degc);
  }
}

void CorrectionFields(auto& visit,
                      AppliedCorrection& applied,
                      Eigen::Vector3d& scale,
                      Eigen::Matrix3d& matrix) {
  visit("offset", applied.offset, kNumbers);
  visit("scale", scale, kNumbers);
  visit("matrix", matrix, kNumbers);
  visit.Map("thermal", [&](auto& in) { ThermalFields(in, applied.thermal.emplace()); });
}

}  // namespace

Eigen::Vector3d AppliedCorrection::Thermal::At(double temperature_degc) const {
  // Outside of the temperature range the firmware keeps the correction constant.
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
  FieldReader::ReadMap(
      yaml, [&](FieldReader& visit) { CorrectionFields(visit, applied, scale, matrix); });
  const Eigen::Matrix3d correction = matrix * scale.asDiagonal();
  // A correction is nearly a rotation times a common gain, so its determinant is near gain³. A far
  // smaller determinant is a typing error, and the inverse of the matrix would amplify the noise.
  constexpr double kSmallestDeterminant = 1e-3;
  const double size = correction.norm() / std::sqrt(3.0);
  if (!(std::abs(correction.determinant()) > kSmallestDeterminant * size * size * size)) {
    yaml.Fail("scale and matrix cannot be undone, because together they are singular or nearly so");
    return std::nullopt;
  }
  applied.inverse = correction.inverse();
  return applied;
}

void AppliedSchema(std::string_view key, FieldSchema& visit) {
  const auto fields = [](FieldSchema& in) {
    AppliedCorrection applied;
    Eigen::Vector3d scale;
    Eigen::Matrix3d matrix;
    CorrectionFields(in, applied, scale, matrix);
  };
  visit.Map(key, fields, {.words = {{"none"}}});
}

}  // namespace truetriad
