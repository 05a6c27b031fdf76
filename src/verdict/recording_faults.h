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

// Faults of single readings or rows. The residuals of the rests' means do not show such faults.
struct RecordingFaults {
  Findings findings;
  std::vector<LeftOutTest> tests;
  Eigen::MatrixXd covariance;  // what faults add to that of the free shared coordinates
};

// Tests for
//
//   readings with errors of one sign (StreamSummary);
//   lost rows (lost_rows.h), also if every n-th row is lost, which does not make turns scatter;
//   turns that extend into the rests. About a turn's axis, the gyroscope's mean in the last quarter
//     of the rest before the turn, and in the first quarter of the rest after it, is compared with
//     the mean in the middle half of the same rest. The difference times the quarter's duration is
//     an angle that the turn lacks. All turns are too short by the mean of both angles' sum.
//
// If a fault would change the solution by m, it adds m m^T to the covariance. `sigma_raw`: σ of one
// reading.
RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const ReducedSystem& system);

}  // namespace truetriad
