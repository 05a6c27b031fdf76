// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// (S_m, dip) and (-S_m, -dip) explain the same readings with every attitude, or where those are
// given the field, turned half a turn about the vertical. A start that disturbed poses have spoilt
// may have ended on the wrong side of the equator: then this changes the shared parameters, and
// true says that the attitudes are to be turned with them. Never where something else knows north
// from south.
bool SettleHemisphereOfField(const CalibrateOptions& options, PoseGraph* graph);

}  // namespace truetriad
