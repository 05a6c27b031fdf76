// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The clock of each vector sensor against the gyroscope's, from the moves between rests of a
// settled graph. A reading that is reported by d later than it was taken shows the field where the
// body was d ago,
//
//   C (y - b) - R^T v = -d (R^T v x w) + (dw/dt x r + w x (w x r))
//
// R carried on by the gyroscope from rest to rest, w its rate; r, of the accelerometer alone, is
// where it sits off the point about which hands turn the unit. Moves weigh by how well each fits;
// σ comes from leaving each out in turn, so that whatever else goes on in a move is counted, if it
// differs from move to move. A sensor without enough moves has none.
std::vector<ClockOffset> FindClockOffsets(const PoseSet& poses, const PoseGraph& graph);

// What an offset does to a solution: a clock that is late by d changes the mean of a rest by d
// times what the readings at its ends differ by over its duration, and the forces that a
// g-sensitivity sees during a turn. With y those changes for one second, the free coordinates move
// by m = M^-1 J^T D y sqrt(d^2 + σ^2), which is next to nothing where rests are still to their
// ends.
Eigen::VectorXd MovedByClock(const ClockOffset& offset,
                             const PoseGraph& graph,
                             const ReducedSystem& system);

// Whether an offset is neither chance nor within a reading of the gyroscope.
bool IsNotable(const ClockOffset& offset, const PoseSet& poses);

// What is said of an offset against the clock of `reference` that is taken off.
Finding ClockCorrected(Triad triad, double later_s, double sigma_s, Triad reference);

}  // namespace truetriad
