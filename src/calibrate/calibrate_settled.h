// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "choice/model_choice.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

// The calibration as the options state it, before any pose is used.
Calibration StatedCalibration(const CalibrateOptions& options);

// Calibrate with options that leave nothing to be chosen. `settled` receives the solved graph of
// poses and its noise, unless null.
Result<CalibrationSummary> CalibrateSettled(const PoseSet& poses,
                                            const CalibrateOptions& options,
                                            SettledModel* settled);

}  // namespace truetriad
