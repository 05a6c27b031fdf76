// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"

namespace truetriad {

// A logger that is faster than a sensor writes each of its readings again until there is a new one.
// Such repeats say nothing of the sensor's noise, and nothing of when they are stamped.

/// Leaves the first of equal readings in a row where a sensor's readings are held: of `stream`.
/// Returns how many were left out.
std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track);

/// The step that all readings of rows which each are a pose were rounded to, on all axes; 0 where
/// they show none. From one pose to the next they differ by many.
double StepOfRows(Triad triad, const std::vector<StaticPose>& poses);

/// Of rows that each are a pose: leaves out what a sensor reads as in the row before, and rows that
/// are left with nothing, with a finding.
void LeaveOutRepeats(PoseSet* set);

}  // namespace truetriad
