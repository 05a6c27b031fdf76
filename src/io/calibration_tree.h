// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tree/json.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// A calibration as in calibration.json, with the same content as calibration.yaml.
Json CalibrationTree(const Calibration& calibration);

/// `tree` with its whole numbers as integers, and null in place of numbers that are not finite.
Json AsInYaml(Json tree);

/// A YAML text as JSON; numbers that are not finite become null. Returns the text itself if it is
/// not YAML, or if aliases repeat so much that it has more values than characters.
Json TreeOfYaml(const std::string& text);

}  // namespace truetriad
