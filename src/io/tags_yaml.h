// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "io/yaml_reader.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// Reads the tags of `device:`, which has other keys, too.
void ReadDeviceTags(YamlReader* device, Tags* tags);

/// Reads the tags of `run:`, if present.
void ReadRunTags(YamlReader run, Tags* tags);

/// The tags as they are written within a map in one line: ` part: "P1", ids: { gyroscope: 7 }`;
/// empty without any.
std::string DeviceTagsText(const Tags& tags);
std::string RunTagsText(const Tags& tags);

}  // namespace truetriad
