// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"
#include "truetriad/model/quality.h"

namespace truetriad {

// Faults of single readings, which the residuals of a rest's mean do not show.
struct RecordingFaults {
  Findings findings;
  std::vector<LeftOutTest> tests;
  Eigen::MatrixXd covariance;  // added to that of the free shared coordinates
};

// Tests for
//
//   readings with errors of one sign (StreamSummary);
//   lost rows (lost_rows.h), also if every n-th row is lost, which does not make turns scatter;
//   turns that extend into the rests. The gyroscope's mean in the last quarter of the rest before a
//     turn, and in the first quarter of the rest after it, is compared with the middle half of the
//     rest, about the turn's axis. All turns are too short by the mean of these angles' sums.
//
// A fault that changes the solution by m adds m m^T to its covariance. `sigma_raw`: of one
// reading.
RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const ReducedSystem& system);

}  // namespace truetriad
