// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The offset of each vector sensor's clock from the gyroscope's, from the moves between rests of a
// settled graph. A reading that is reported d after it was taken is of the field in the body's
// attitude d before,
//
//   C (y - b) - R^T v = -d (R^T v x w) + (dw/dt x r + w x (w x r))
//
// R is propagated by the gyroscope from rest to rest, w its rate; r, for the accelerometer alone,
// is its place relative to the point about which hands turn the unit. Moves are weighted by their
// fit; σ is found by leaving out one move after another, so that it includes all other effects that
// differ from move to move. A sensor without enough moves has no offset.
std::vector<ClockOffset> FindClockOffsets(const PoseSet& poses, const PoseGraph& graph);

// The effect of an offset on a solution: a clock that is late by d changes the mean of a rest by d
// times the difference of the readings at its ends over its duration, and the forces by which a
// g-sensitivity acts during a turn. With y these changes for one second, the free coordinates
// change by m = M^-1 J^T D y sqrt(d^2 + σ^2), which is negligible if rests are still to their ends.
Eigen::VectorXd MovedByClock(const ClockOffset& offset,
                             const PoseGraph& graph,
                             const ReducedSystem& system);

// Whether an offset is significant and exceeds the time between two gyroscope readings.
bool IsNotable(const ClockOffset& offset, const PoseSet& poses);

// The finding for a corrected offset relative to the clock of `reference`.
Finding ClockCorrected(Triad triad, double later_s, double sigma_s, Triad reference);

}  // namespace truetriad
