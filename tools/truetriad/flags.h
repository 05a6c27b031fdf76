// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <gflags/gflags.h>

// Flags that several verbs share; gflags stops the program at a second definition.
DECLARE_string(input);
DECLARE_string(output);
DECLARE_string(config);
DECLARE_string(calibration);
DECLARE_string(poses);
DECLARE_string(set);

namespace truetriad {

/// The items of --set. Brackets and quotes that do not match are left for the YAML reader to
/// report.
std::vector<std::string> Overrides();

}  // namespace truetriad
