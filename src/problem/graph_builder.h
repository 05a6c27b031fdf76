// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/graph.h"
#include "problem/lay_out.h"
#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Least σ of a pose's mean reading, as a share of the field: with a smaller σ, weights could differ
// by a factor above 1e14, close to the 1e16 that a double resolves.
inline constexpr double kLeastNoiseShare = 1e-7;

// Builds the nodes of known motions, and a node for each pose with a reading of accelerometer or
// magnetometer, or of a gyroscope that is alone. A pose's node has the given attitude and, if
// `sources` says that it is known, the covariance inside the rest; weights and excess noise are set
// later. Error (bad input): a pose lacks an attitude, heading or temperature that `options` need,
// or its face is ambiguous.
Result<std::vector<PoseNode>> BuildNodes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         const PerTriad<NoiseSource>& sources);

// Sets the turns between the nodes, integrated at the start values, and the headings that only
// these turns determine. Call it after LayOutParameters.
void BuildIncrements(const PoseSet& poses, const StartValues& start, PoseGraph* graph);

// The graph that `options` ask for, beginning at `solved`, a solution with other terms. A parameter
// of both graphs keeps its value, projected on what `options` leave free.
PoseGraph WithTermsOf(const CalibrateOptions& options, const PoseGraph& solved);

// The index in `whole` of each entry of `part`, found by name; -1: `whole` has no such entry.
std::vector<int> PlacesIn(const SharedLayout& whole, const SharedLayout& part);

}  // namespace truetriad
