// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "io/yaml_reader.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

// Lists of a scenario. Each that is there takes the place of what was said before.

/// Files are relative to `file`.
void ReadMotion(YamlReader reader, const std::string& file, std::vector<MotionStep>* motion);

void ReadTemperature(YamlReader reader, SimulatedTemperature* temperature);

void ReadDisturbances(YamlReader reader, std::vector<Disturbance>* disturbances);

}  // namespace truetriad
