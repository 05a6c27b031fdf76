// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The `quality:` of calibration.yaml.
void WriteQuality(YamlText& out, const Quality& quality);
void ReadQuality(YamlReader reader, Quality* quality);

}  // namespace truetriad
