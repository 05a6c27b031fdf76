// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "truetriad/data/static_pose.h"

namespace truetriad {

// Where a recording was put together from pieces: the gyroscope does not tell the turn there, so no
// turn leads across.

// Gives moves that lead across a joint, by what is known of set->joints and by what the sensors
// show, their fault.
void BreakMovesAtJoints(PoseSet* set);

// Adds to set->joints those that the sensors of a unit that never rests show, and says so.
void FindJointsInMotion(PoseSet* set);

}  // namespace truetriad
