// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/allan/allan.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// The text of allan.yaml (`format: truetriad/allan/1`): every coefficient in the recording's unit
/// with its interval, as a continuous-time and as a per-sample value, and the points of the curve.
std::string AllanToYaml(const AllanResult& result);

/// Reads the file back to the same bits. Errors (bad input) state their line.
Result<AllanResult> ReadAllanFile(const std::string& path);

}  // namespace truetriad
