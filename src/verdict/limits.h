// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Judges each of `limits` by its worst value, which is the one whose guard band of k σ is nearest
// to the limit or furthest beyond it. If there are temperature terms, the values over the
// calibrated temperature range are judged. Error (usage): this calibration lacks a limited
// quantity, and the limit is not `if_present`.
Result<std::vector<LimitCheck>> JudgeLimits(const Calibration& calibration,
                                            const PoseSet& poses,
                                            const LimitOptions& limits);

}  // namespace truetriad
