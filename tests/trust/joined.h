// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "trust/faults.h"

namespace truetriad::trust {

// Recordings that are not of one piece. Severity: the number of pieces, unless stated otherwise.

// The pieces in another order, the times made regular.
void PiecesExchanged(const Strike& strike, Recording* recording);
// Seconds are missing between the pieces, the times made regular.
void PiecesCutOut(const Strike& strike, Recording* recording);
// Each piece begins at time zero.
void ClockSetBack(const Strike& strike, Recording* recording);
// A piece comes again later, the times made regular. Severity: its seconds.
void RepeatedElsewhere(const Strike& strike, Recording* recording);
// The readings between rests are missing, the times made regular. Severity: the share of the moves.
void MovesCutOut(const Strike& strike, Recording* recording);

}  // namespace truetriad::trust
