// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

/// Estimates from the poses everything that `options` asks for. Errors (usage or bad input):
/// options that contradict each other or the poses. Too little data is not an error but an outcome.
Result<CalibrationSummary> Calibrate(const PoseSet& poses, const CalibrateOptions& options);

}  // namespace truetriad
