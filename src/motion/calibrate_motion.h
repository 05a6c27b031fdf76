// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

// Calibrates a unit that was tumbled without rests (`options.motion`, PoseSet::tracks). Errors:
// those of Calibrate. On entry, `summary` already holds the values that the options state.
Status CalibrateMotion(const PoseSet& poses,
                       const CalibrateOptions& options,
                       CalibrationSummary* summary);

}  // namespace truetriad
