// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tree/json.h"

namespace truetriad {

/// JSON Schemas of files that users write, made from the same lists of fields that read the files.
Json ExperimentSchema();
Json SensorPresetSchema();
Json LimitsPresetSchema();
Json ScenarioSchema();
Json RecordingSchema();  ///< Of a recording's manifest; defined in io/manifest.cc.

}  // namespace truetriad
