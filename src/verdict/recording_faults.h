// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "verdict/left_out_terms.h"
#include "verdict/turn_scatter.h"

namespace truetriad {

// What the recording itself shows to be off, which no residual does: one-sided readings
// (StreamSummary), rows that were lost (lost_rows.h), or make turns scatter along their axes
// (turn_scatter.h), or either taken together. Is added to `terms`. `sigma_raw`: of one reading.
void AddFaultsOfRecording(const PoseSet& poses,
                          const PerTriad<Eigen::Vector3d>& sigma_raw,
                          const std::vector<TurnMiss>& misses,
                          const PoseGraph& graph,
                          const Eigen::MatrixXd& covariance,
                          LeftOutTerms* terms);

}  // namespace truetriad
