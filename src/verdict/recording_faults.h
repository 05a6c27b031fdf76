// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "verdict/left_out_terms.h"

namespace truetriad {

// What the recording itself shows to be off, which no residual does: one-sided readings
// (StreamSummary), lost rows (lost_rows.h). Is added to `terms`. `sigma_raw`: of one reading.
void AddFaultsOfRecording(const PoseSet& poses,
                          const PerTriad<Eigen::Vector3d>& sigma_raw,
                          const PoseGraph& graph,
                          const Eigen::MatrixXd& covariance,
                          LeftOutTerms* terms);

// Turns between rests that miss more along their axes than across (turn_scatter.h).
void AddTurnScatter(const PoseGraph& graph, const ReducedSystem& system, LeftOutTerms* terms);

}  // namespace truetriad
