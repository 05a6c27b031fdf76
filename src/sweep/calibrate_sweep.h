// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

// Calibrates from the windows of a temperature sweep (`options.sweep`, PoseSet::sweep): estimates
// the terms of the bias in temperature and its rate, axis by axis. Errors: those of Calibrate, and
// a static calibration that does not fit. On entry, `summary` already holds the values that the
// options state.
Status CalibrateSweep(const PoseSet& poses,
                      const CalibrateOptions& options,
                      CalibrationSummary* summary);

}  // namespace truetriad
