// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "io/yaml_reader.h"
#include "truetriad/config/plan.h"

namespace truetriad {

/// Reads the `plan:` block of the experiment at `path` on top of what is there.
void ReadPlan(YamlReader reader, const std::string& path, PlanConfig* plan);

}  // namespace truetriad
