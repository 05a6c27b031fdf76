// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "problem/graph.h"
#include "problem/start_values.h"
#include "start/start.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The finding if a gyroscope with a held matrix or bias predicts turns that are far from those of
// gravity between the rests; unset if they agree, or nothing is held. A solution with such a
// gyroscope would distort the poses to fit its turns. `nodes` as of BuildNodes.
std::optional<Finding> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                               const StartValues& start,
                                               const std::vector<PoseNode>& nodes,
                                               const CalibrateOptions& options);

}  // namespace truetriad
