// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// A sensor of calibration.yaml: model, uncertainty, temperature terms, noise.
void WriteSensor(YamlText& out, Triad triad, const TriadCalibration& sensor);
void ReadSensor(YamlReader reader, TriadCalibration* sensor);

}  // namespace truetriad
