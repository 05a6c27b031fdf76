// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Sets the fault of known turns whose rows or times begin or end while the unit still turns, so
/// that a part of their angle is outside, and names them in set->findings. Needs set->poses.
void RejectCutTurns(PoseSet* set);

}  // namespace truetriad
