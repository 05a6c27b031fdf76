// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>

#include "truetriad/calibrate/evaluate.h"

namespace truetriad {

// Numbers of poses that each sensor is not judged by.
using PosesLeftOut = PerTriad<std::set<int>>;

// Lists what the calibration left out of the poses that it was made from. The list is empty for
// other poses, and where their number is not the same.
PosesLeftOut LeftOut(const Calibration& calibration, const PoseSet& poses, bool is_own);

Result<EvaluationSummary> EvaluateWithout(const PosesLeftOut& left_out,
                                          const Calibration& calibration,
                                          const PoseSet& poses,
                                          bool is_own,
                                          const CountSizes& si_per_count);

}  // namespace truetriad
