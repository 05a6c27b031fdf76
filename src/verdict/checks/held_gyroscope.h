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

// The finding if a gyroscope whose matrix or bias is held measures turns that differ much from
// those of gravity, or the field, between the rests; unset if both agree, or if nothing is held.
// Wrong held values would make a solution distort the poses to fit the turns. `nodes`: from
// BuildNodes.
std::optional<Finding> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                               const StartValues& start,
                                               const std::vector<PoseNode>& nodes,
                                               const CalibrateOptions& options);

}  // namespace truetriad
