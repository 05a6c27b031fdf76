// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Judges each of `limits` by its worst value: the one that with k σ is nearest to the limit or
// furthest beyond it, with temperature terms over all temperatures of the calibration. Error
// (usage): a limit on a quantity that this calibration lacks.
Result<std::vector<LimitCheck>> JudgeLimits(const Calibration& calibration,
                                            const PoseSet& poses,
                                            const LimitOptions& limits);

}  // namespace truetriad
