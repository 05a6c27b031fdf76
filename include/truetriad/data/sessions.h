// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Several recordings of one unit, which was switched off in between, as one set: poses are
/// numbered through, times of a later session come after those of the one before, and no move leads
/// from one to the other. Error (bad input): different serials, units of measurement, or only some
/// have times.
Result<PoseSet> JoinSessions(std::vector<PoseSet> sessions);

}  // namespace truetriad
