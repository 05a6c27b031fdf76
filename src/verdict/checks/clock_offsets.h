// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
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

// Whether an offset is neither chance nor within a reading of the gyroscope.
bool IsNotable(const ClockOffset& offset, const PoseSet& poses);

// What is said of an offset against the clock of `reference` that is taken off.
Finding ClockCorrected(Triad triad, double later_s, double sigma_s, Triad reference);

}  // namespace truetriad
