// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Joins recordings of one unit, which was switched off in between, into one set. Poses are
/// numbered consecutively, the times of a session come after those of the session before, and no
/// move leads from one session to the next. Error (bad input): serials, sensors or units of
/// measurement differ, or only some of the recordings have times.
Result<PoseSet> JoinSessions(std::vector<PoseSet> sessions);

}  // namespace truetriad
