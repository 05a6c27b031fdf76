// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "truetriad/data/static_pose.h"

namespace truetriad {

// A joint is where a recording was put together from pieces: the gyroscope does not show the change
// of attitude there, so no turn is integrated across it.

// Sets the fault of moves across a joint, and adds findings. Joints are those in set->joints, and
// those that the readings show.
void BreakMovesAtJoints(PoseSet* set);

// Adds to set->joints the joints in the readings of a unit that never rests, with findings.
void FindJointsInMotion(PoseSet* set);

}  // namespace truetriad
