// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "io/yaml_reader.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// Reads the tags of `device:`; its other keys are left to the caller.
void ReadDeviceTags(YamlReader* device, Tags* tags);

/// Reads the tags of `run:`, if present.
void ReadRunTags(YamlReader run, Tags* tags);

/// The tags as written inside a map on one line: ` part: "P1", ids: { gyroscope: 7 }`; empty if
/// there are none.
std::string DeviceTagsText(const Tags& tags);
std::string RunTagsText(const Tags& tags);

}  // namespace truetriad
