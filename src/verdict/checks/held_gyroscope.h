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

// The finding that held values of a gyroscope's matrix or bias are wrong: its turns differ much
// from those that gravity, or the field, shows between the rests. Unset if they agree, or if
// nothing is held. A solution with wrong held values would distort the poses to fit the turns.
// `nodes`: from BuildNodes.
std::optional<Finding> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                               const StartValues& start,
                                               const std::vector<PoseNode>& nodes,
                                               const CalibrateOptions& options);

}  // namespace truetriad
