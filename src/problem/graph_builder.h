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

// What is counted as noise of a pose mean at least, as a share of the field: where there is less,
// the weights differ by more than can be computed with.
inline constexpr double kLeastNoiseShare = 1e-7;

// One node a pose that saw a wanted triad, with its attitude where it is given and the covariance
// inside its rest where `sources` says that it is known; weights and excess noise come later.
// Error (bad input): no attitude where all are to be given; faces that cannot be told apart.
Result<std::vector<PoseNode>> BuildNodes(const PoseSet& poses,
                                         const CalibrateOptions& options,
                                         const PerTriad<NoiseSource>& sources);

// The turns between the nodes, integrated at the start values, and with them the headings that
// nothing else tells. After LayOutParameters.
void BuildIncrements(const PoseSet& poses, const StartValues& start, PoseGraph* graph);

// The graph that `options` ask for, at that point of it which is nearest to a solution with other
// terms: parameters of one name have one value, as far as `options` leave them free.
PoseGraph WithTermsOf(const CalibrateOptions& options, const PoseGraph& solved);

// Where each free entry of `part` stands in `whole`, by name; -1 where there is none.
std::vector<int> PlacesIn(const SharedLayout& whole, const SharedLayout& part);

}  // namespace truetriad
