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

// As Calibrate, for options that leave nothing to be chosen. Unless null, `settled` receives the
// solved graph of a calibration from poses, and its noise.
Result<CalibrationSummary> CalibrateSettled(const PoseSet& poses,
                                            const CalibrateOptions& options,
                                            SettledModel* settled);

}  // namespace truetriad
