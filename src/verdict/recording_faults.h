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
enum class RecordingFaultKind {
  kOneSided,  // single readings are off to one side
  kLostRows,  // of the gyroscope, whose turns are too short by them
  kRounding,  // of the gyroscope: at rest it reads the same step throughout
  kSettling,  // of the gyroscope: turns go on into the rests
};

struct RecordingFault {
  Triad triad = Triad::kAccelerometer;
  RecordingFaultKind kind = RecordingFaultKind::kOneSided;
  double p_value = 0.0;
  double effect_sigmas = 0.0;  // by which some parameter is off
  double share = 0.0;          // of the rows, that are lost
};

struct RecordingFaults {
  std::vector<RecordingFault> found;
  std::vector<LeftOutTest> tests;
  Eigen::MatrixXd covariance;  // what the free shared coordinates are less certain by
};

// One-sided readings (StreamSummary), readings in steps that are larger than their noise, and rows
// that were lost (lost_rows.h). `sigma_raw`: of one reading.
RecordingFaults FindRecordingFaults(const PoseSet& poses,
                                    const PerTriad<Eigen::Vector3d>& sigma_raw,
                                    const PoseGraph& graph,
                                    const Eigen::MatrixXd& covariance);

// Adds turns that go on into the rests: what the gyroscope reads in the first quarter of a rest,
// beyond its middle half, about the axis of the turn before, and in the last quarter about that of
// the next. By the mean angle of it all turns are too short, however large they are.
void AddUnsettledTurns(const PoseSet& poses,
                       const PoseGraph& graph,
                       const ReducedSystem& system,
                       RecordingFaults* faults);

// Says so.
Findings FindingsOf(const RecordingFaults& faults);

}  // namespace truetriad
