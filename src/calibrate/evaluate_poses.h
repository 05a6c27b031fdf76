// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>

#include "truetriad/calibrate/evaluate.h"

namespace truetriad {

// Numbers of poses that each sensor is not judged by.
using PosesLeftOut = PerTriad<std::set<int>>;

// What the calibration left out of the poses that it was made from; of others nothing, nor where
// they are not the same number.
PosesLeftOut LeftOut(const Calibration& calibration, const PoseSet& poses, bool is_own);

Result<EvaluationSummary> EvaluateWithout(const PosesLeftOut& left_out,
                                          const Calibration& calibration,
                                          const PoseSet& poses,
                                          bool is_own,
                                          const CountSizes& si_per_count);

}  // namespace truetriad
