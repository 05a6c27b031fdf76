// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "verdict/left_out_terms.h"

namespace truetriad {

// Adds turns that go on into the rests: what the gyroscope reads in the first quarter of a rest,
// beyond its middle half, about the axis of the turn before, and in the last quarter about that of
// the next. By the mean angle of it all turns are too short, however large they are.
void AddUnsettledTurns(const PoseSet& poses,
                       const PoseGraph& graph,
                       const ReducedSystem& system,
                       LeftOutTerms* terms);

}  // namespace truetriad
