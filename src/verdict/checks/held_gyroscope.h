// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problem/graph.h"
#include "problem/start_values.h"
#include "start/start.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// A gyroscope whose matrix or bias is held and whose turns are far from what gravity at the rests
// says of them, in words; unset where they agree, or nothing is held. Solved with it, the poses
// would be bent after the turns. `nodes` as BuildNodes gives them.
std::optional<std::string> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                                   const StartValues& start,
                                                   const std::vector<PoseNode>& nodes,
                                                   const CalibrateOptions& options);

// What is to be said of one that is off by less, from the turns' noise beyond that of their
// readings; empty where that is small.
std::string RemarkOnHeldGyroscope(const CalibrateOptions& options, double turn_excess_sigma_rad);

}  // namespace truetriad
