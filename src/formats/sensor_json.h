// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "formats/format.h"
#include "tree/json.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The blocks of our own JSON files, which hold every term.

inline constexpr int kAnyOrder = 99;  // More than any model has.
inline constexpr TriadCapacity kHoldsAll = {.held = true,
                                            .bias_order = kAnyOrder,
                                            .matrix_thermal = true,
                                            .rate_thermal = true,
                                            .g_sensitivity = true,
                                            .axis_terms = true};

// Units, bias, sensitivity, correction, σ and all other terms of a sensor.
Json SensorJson(const TriadCalibration& sensor);

Json CovarianceJson(const NamedCovariance& covariance);

// The member `sensors` of a file, with the equation
//
//   truth = C(T) u(raw - b(T) - G force),  C = S^-1,  T clamped to range_degc
//
// u as in triad_model.h; the reading itself where there is no axis term.
Result<Carried> ReadSensorsJson(const std::string& text, const std::string& name);

}  // namespace truetriad
