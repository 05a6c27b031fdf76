// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Error: gravity jumps between two windows of one attitude of a sweep, as of a unit that was
/// turned.
Status CheckHeld(const PoseSet& set);

/// Warns of a small turn: gravity steps across itself, and stays there. What temperature does is
/// slow, and goes along gravity as well.
void NameTurns(PoseSet* set);

}  // namespace truetriad
