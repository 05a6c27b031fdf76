// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "data/pose_statistics.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Takes out the readings of a triad in rests that are none for it while they are for another
/// triad: the unit is still, but a clock that is off by part of a second puts the end of the turn
/// before, or the beginning of the next one, into the rest; or a magnet passes.
///
/// A rest moves for a triad when an eighth of it at an end differs from its middle half by more
/// than half a percent of what the rests differ by among each other, and by more than eight times
/// the wander of the middle of rests by and large; or when its own middle wanders by three percent.
/// Fewer eighths than the noise allows tell nothing.
///
/// Warns with the numbers of the rests. Where most rests of a triad move, all of them
/// stay, and nothing is said. Returns whether any reading was taken out. `moments[i]` belongs to
/// set->poses[i], which need their numbers.
bool RemoveMovingReadings(const std::vector<PerTriad<TriadPoseMoments>>& moments, PoseSet* set);

}  // namespace truetriad
