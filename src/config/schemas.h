// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tree/json.h"

namespace truetriad {

/// The JSON Schemas of files that users write, made from the lists of fields that read them.
Json ExperimentSchema();
Json SensorPresetSchema();
Json LimitsPresetSchema();
Json ScenarioSchema();
Json RecordingSchema();  ///< Of a manifest; defined beside its reader, io/manifest.cc.

}  // namespace truetriad
