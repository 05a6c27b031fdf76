// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

/// Estimates everything that `options` asks for from the poses. Errors: options that contradict
/// each other or the poses (usage or bad input). Too little data is not an error but an outcome.
Result<CalibrationSummary> Calibrate(const PoseSet& poses, const CalibrateOptions& options);

}  // namespace truetriad
