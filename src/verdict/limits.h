// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Judges the limits that are set, each by the worst of its numbers: the one whose value with k σ is
// nearest to a limit or furthest beyond; with temperature terms over all temperatures of the
// calibration. Error (usage): a quantity that this calibration lacks.
Result<std::vector<LimitCheck>> JudgeLimits(const Calibration& calibration,
                                            const PoseSet& poses,
                                            const LimitOptions& limits);

}  // namespace truetriad
