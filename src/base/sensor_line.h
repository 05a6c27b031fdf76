// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "truetriad/base/triad.h"

namespace truetriad {

// "`sensors: { accelerometer: { model: full } }`": keys of a sensor as a line that an experiment
// takes. tests/config/remedies_test.cc types them all.
inline std::string SensorLine(std::string_view sensor, std::string_view keys) {
  return "`sensors: { " + std::string(sensor) + ": { " + std::string(keys) + " } }`";
}
inline std::string SensorLine(Triad triad, std::string_view keys) {
  return SensorLine(TriadName(triad), keys);
}

}  // namespace truetriad
