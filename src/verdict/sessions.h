// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/graph.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/quality.h"

namespace truetriad {

// If sessions have biases of their own, states in `quality` each session's bias and the scatter
// from session to session. `free_covariance`: of the graph's free coordinates.
void StateSessions(const PoseSet& poses,
                   const PoseGraph& graph,
                   const Eigen::MatrixXd& free_covariance,
                   RestQuality* quality);

}  // namespace truetriad
