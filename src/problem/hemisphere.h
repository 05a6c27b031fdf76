// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Labels the same solution by the field that is there. (S_m, dip), (-S_m, -dip) and (S_m, pi - dip)
// explain the same readings with every attitude, or where those are given the field, turned half a
// turn about the vertical. A start that disturbed or missing poses have spoilt may have ended on
// the wrong side of the equator, or with a dip beyond 90 degrees: then this changes the shared
// parameters and the poses; true says that attitudes which the graph does not hold are to be turned
// with them. The side of the equator stays where something else knows north from south.
bool SettleHemisphereOfField(const CalibrateOptions& options, PoseGraph* graph);

// As those are turned.
Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude);

}  // namespace truetriad
