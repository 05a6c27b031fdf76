// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "truetriad/base/triad.h"

namespace truetriad {

// "`sensors: { accelerometer: { model: full } }`": a line of an experiment, which messages quote as
// a remedy. tests/config/remedies_test.cc parses every such line.
inline std::string SensorLine(std::string_view sensor, std::string_view keys) {
  return "`sensors: { " + std::string(sensor) + ": { " + std::string(keys) + " } }`";
}
inline std::string SensorLine(Triad triad, std::string_view keys) {
  return SensorLine(TriadName(triad), keys);
}

}  // namespace truetriad
