// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "formats/format.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The blocks of our own JSON files.

// A line of an object: name, value and comma.
std::string Member(std::string_view indent, std::string_view name, const std::string& value);

// Members in braces, the closing one indented.
std::string Object(std::string members, std::string_view indent);

// Units, bias, sensitivity, correction, σ and all other terms of a sensor.
std::string SensorMembers(const TriadCalibration& sensor);

std::string CovarianceText(const NamedCovariance& covariance);

// The member `sensors` of a file, with the equation
//
//   truth = C(T) u(raw - b(T) - G force),  C = S^-1,  T clamped to range_degc
//
// u as in triad_model.h; the reading itself where there is no axis term.
Result<Carried> ReadSensorsJson(const std::string& text, const std::string& name);

}  // namespace truetriad
