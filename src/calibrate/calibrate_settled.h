// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "choice/model_choice.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

// The calibration before any pose is used: only the values that the options state.
Calibration StatedCalibration(const CalibrateOptions& options);

// Like Calibrate, but for options without `auto`, which leave nothing to be chosen. Unless it is
// null, `settled` receives the solved graph and the noise of a calibration from poses.
Result<CalibrationSummary> CalibrateSettled(const PoseSet& poses,
                                            const CalibrateOptions& options,
                                            SettledModel* settled);

}  // namespace truetriad
