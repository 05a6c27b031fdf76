// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tree/json.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// What calibration.yaml says, as calibration.json has it.
Json CalibrationTree(const Calibration& calibration);

/// `tree` with its numbers as a YamlText of so many digits writes them: whole ones without a point.
Json AsInYaml(Json tree, int digits = 0);

/// A YAML text as JSON; numbers that are none become null. What is no YAML by itself, or repeats
/// aliases beyond its own length, stays a text.
Json TreeOfYaml(const std::string& text);

}  // namespace truetriad
