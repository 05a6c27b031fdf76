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

// What single readings show to be off, which no residual of their means does.
struct RecordingFaults {
  Findings findings;
  std::vector<LeftOutTest> tests;
  Eigen::MatrixXd covariance;  // what the free shared coordinates are less certain by
};

// Looks for
//
//   readings that are off to one side (StreamSummary);
//   a gyroscope that rests on one step, so that its bias is known to a step only;
//   rows that were lost (lost_rows.h): every n-th one, too, of which turns show no scatter;
//   turns that go on into the rests: what the gyroscope reads in the first quarter of a rest,
//     beyond its middle half, about the axis of the turn before, and in the last quarter about that
//     of the next. By the mean angle of it all turns are too short, however large they are.
//
// Each moves the solution by some m and widens its covariance by m m^T. `sigma_raw`: of one
// reading.
RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const ReducedSystem& system);

}  // namespace truetriad
