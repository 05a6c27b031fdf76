// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/repeatability.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

#include "problem/parameter_name.h"

namespace truetriad {
namespace {

std::optional<double> NumberOf(std::string_view text) {
  double value = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = failure == std::errc() && end == text.data() + text.size();
  return is_whole && std::isfinite(value) && value >= 0.0 ? std::optional(value) : std::nullopt;
}

}  // namespace

Result<Repeatability> ParseRepeatability(const std::vector<std::string>& items) {
  Repeatability repeatability;
  for (const std::string& item : items) {
    const std::size_t dot = item.find('.'), equals = item.find('=');
    const bool has_both = dot < equals && equals != std::string::npos;
    const auto triad = TriadFromName(item.substr(0, dot));
    const std::string quantity = has_both ? item.substr(dot + 1, equals - dot - 1) : "";
    const auto value =
        has_both ? NumberOf(std::string_view(item).substr(equals + 1)) : std::optional<double>();
    if (!triad || !value || (quantity != "bias" && quantity != "scale")) {
      return Error(ErrorCode::kInvalidArgument,
                   "--repeatability: `" + item +
                       "` is not understood; expected SENSOR.bias=σ in m/s^2, rad/s or uT, or "
                       "SENSOR.scale=σ as a share, as in accelerometer.bias=0.01");
    }
    (quantity == "bias" ? repeatability.bias : repeatability.scale)[*triad] = *value;
  }
  return repeatability;
}

Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration) {
  NamedCovariance& covariance = calibration.covariance;
  const std::vector<std::string>& names = covariance.parameters;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto one = ParameterName::Parse(names[i]);
    if (!one || one->power != 0 || !calibration.sensors[one->triad]) continue;
    // Raw units: S takes a bias of true units there.
    const Eigen::Matrix3d& S = calibration.sensors[one->triad]->model.sensitivity;
    for (std::size_t j = 0; j < names.size(); ++j) {
      const auto other = ParameterName::Parse(names[j]);
      if (!other || other->triad != one->triad || other->kind != one->kind || other->power != 0) {
        continue;
      }
      double& entry = covariance.matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (one->kind == ParameterKind::kBias) {
        entry +=
            std::pow(repeatability.bias[one->triad], 2) * S.row(one->row).dot(S.row(other->row));
      } else if (one->kind == ParameterKind::kSensitivity && i == j && one->row == one->col) {
        entry += std::pow(repeatability.scale[one->triad] * S(one->row, one->row), 2);
      }
    }
  }
  return calibration;
}

}  // namespace truetriad
