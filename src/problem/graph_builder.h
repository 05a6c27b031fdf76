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

// Least σ of a pose mean, as a share of the field: with less, weights differ by over 1e14, close to
// the 1e16 that a double resolves.
inline constexpr double kLeastNoiseShare = 1e-7;

// One node per pose that a wanted triad has a reading of, with its given attitude and, where
// `sources` says that it is known, the covariance inside its rest; weights and excess noise come
// later. Error (bad input): a pose lacks the attitude that all should have; ambiguous faces.
Result<std::vector<PoseNode>> BuildNodes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         const PerTriad<NoiseSource>& sources);

// The turns between the nodes, integrated at the start values, and the headings that only they
// determine. Call it after LayOutParameters.
void BuildIncrements(const PoseSet& poses, const StartValues& start, PoseGraph* graph);

// The graph that `options` ask for, as near as possible to a solution with other terms: parameters
// of one name have one value, as far as `options` leave them free.
PoseGraph WithTermsOf(const CalibrateOptions& options, const PoseGraph& solved);

// Where each free entry of `part` stands in `whole`, by name; -1 where there is none.
std::vector<int> PlacesIn(const SharedLayout& whole, const SharedLayout& part);

}  // namespace truetriad
