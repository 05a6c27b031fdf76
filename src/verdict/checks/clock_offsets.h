// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// Estimates by how much each vector sensor's clock is late against the gyroscope's, from the moves
// between rests of a settled graph. If a reading y (bias b, correcting matrix C) is stamped a time
// d late, it shows the world's field v in the attitude that the body had d earlier:
//
//   C (y - b) - R^T v = -d (R^T v x w) + (dw/dt x r + w x (w x r))
//
// R is the attitude, integrated from rest to rest by the gyroscope, and w its rate. r, for the
// accelerometer alone, is the sensor's position relative to the point about which hands turn the
// unit. A move is weighted by how well it fits. σ is found by leaving out one move after another,
// so that it includes all effects that differ from move to move. A sensor with too few moves gets
// no offset.
std::vector<ClockOffset> FindClockOffsets(const PoseSet& poses, const PoseGraph& graph);

// The change m of the free coordinates by a clock offset d ± σ. A late clock changes the mean of a
// rest if the readings at the rest's two ends differ. During a turn, it changes the forces by which
// a g-sensitivity acts. If a clock that is late by sqrt(d^2 + σ^2) changes the rows by y, m = M^-1
// J^T D y. If the unit is still up to the ends of the rests, m is negligible.
Eigen::VectorXd MovedByClock(const ClockOffset& offset,
                             const PoseGraph& graph,
                             const ReducedSystem& system);

// Whether an offset is significant and clearly exceeds the time between two gyroscope readings.
bool IsNotable(const ClockOffset& offset, const PoseSet& poses);

// The finding for a corrected offset relative to the clock of `reference`.
Finding ClockCorrected(Triad triad, double later_s, double sigma_s, Triad reference);

}  // namespace truetriad
