// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Joins recordings of one unit, which was switched off in between, into one set: poses are
/// numbered consecutively, times of a later session come after those of the one before, and no
/// move leads from one to the other. Error (bad input): different serials, sensors or units of
/// measurement, or only some have times.
Result<PoseSet> JoinSessions(std::vector<PoseSet> sessions);

}  // namespace truetriad
