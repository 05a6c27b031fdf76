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
// by a factor above 1e14, which is close to the 1e16 that a double resolves.
inline constexpr double kLeastNoiseShare = 1e-7;

// Builds the nodes of known motions, and a node for each pose that has a reading of the
// accelerometer, of the magnetometer or, if it is the only sensor, of the gyroscope. The node gets
// the given attitude and, if `sources` says that the noise is known, the covariance within the
// rest. Weights and excess noise are set later. Error (bad input): a pose lacks an attitude,
// heading or temperature that `options` need, or its face is ambiguous.
Result<std::vector<PoseNode>> BuildNodes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         const PerTriad<NoiseSource>& sources);

// Sets the turns between the nodes, integrated at the start values, and the headings that only
// these turns determine. Call it after LayOutParameters.
void BuildIncrements(const PoseSet& poses, const StartValues& start, PoseGraph* graph);

// The graph with the terms of `options`, started from `solved`, a solution with other terms. A
// parameter that both graphs have keeps its value, projected on the directions that `options` leave
// free.
PoseGraph WithTermsOf(const CalibrateOptions& options, const PoseGraph& solved);

// The index in `whole` of each entry of `part`, found by name; -1 if `whole` has no such entry.
std::vector<int> PlacesIn(const SharedLayout& whole, const SharedLayout& part);

}  // namespace truetriad
