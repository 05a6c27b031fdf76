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

// A gyroscope whose matrix or bias is held and whose turns are far from what gravity at the rests
// says of them; unset where they agree, or nothing is held. Solved with it, the poses
// would be bent after the turns. `nodes` as BuildNodes gives them.
std::optional<Finding> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                               const StartValues& start,
                                               const std::vector<PoseNode>& nodes,
                                               const CalibrateOptions& options);

}  // namespace truetriad
