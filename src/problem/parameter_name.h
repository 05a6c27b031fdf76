// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "truetriad/base/triad.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// One entry of a sensor's model, named as in the covariance:
//
//   accelerometer.bias.x                        magnetometer.sensitivity.xy
//   accelerometer.thermal.bias.2.x              magnetometer.thermal.sensitivity.1.xy
//   accelerometer.thermal.rate.linear.x         (quadratic, cross)
//   gyroscope.g_sensitivity.xy                  accelerometer.quadratic.x  (all axis terms)
struct ParameterName {
  Triad triad = Triad::kAccelerometer;
  ParameterKind kind = ParameterKind::kBias;
  int power = 0;  // of tau; 0: at the reference temperature
  int row = 0;
  int col = 0;  // of a matrix only

  bool is_thermal() const { return power > 0 || InfoOf(kind).rate; }
  std::string str() const;
  // Unset if the name is not that of an entry of a sensor's model, like "reference.dip_rad".
  static std::optional<ParameterName> Parse(const std::string& text);
};

}  // namespace truetriad
