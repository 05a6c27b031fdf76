// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "io/yaml_reader.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// Tags of `device:`, which holds more.
void ReadDeviceTags(YamlReader* device, Tags* tags);

/// Of those the `ids:`.
void ReadDeviceIds(YamlReader ids, Tags* tags);

/// Tags of `run:`, where there is one.
void ReadRunTags(YamlReader run, Tags* tags);

}  // namespace truetriad
