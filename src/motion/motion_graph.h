// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "motion/track.h"
#include "problem/graph.h"

namespace truetriad {

// Noise of a tumbling unit's readings, white at the frequencies that matter: raw unit squared times
// seconds, per axis. A mean over T seconds has the variance density / T.
struct MotionNoise {
  PerTriad<Eigen::Vector3d> density;
};

// The moments of a tumbling unit as nodes of a graph that is laid out: each with the mean readings
// of the vector sensors about it, and with the turn to the next as the gyroscope tells it. Where
// one vector sensor is all that a piece of the chain has, nothing tells the heading about what that
// sees, and that of its first attitude is held.
void BuildMoments(const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  const std::vector<Eigen::Quaterniond>& attitudes,
                  PoseGraph* graph);

// What their rows are weighted with, and the robust weights of the moments. The turns' noise goes
// through the correction of the graph's gyroscope.
void WeighMoments(const MotionNoise& noise,
                  const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  PoseGraph* graph);

std::vector<Eigen::Quaterniond> AttitudesOf(const PoseGraph& graph);

// By how much more than corrected a vector sensor's clock is ahead of the gyroscope's, with its
// σ: the residuals against how fast the field turns, dx/dt = x x omega.
struct ClockError {
  double ahead_s = 0.0;
  double sigma_s = 0.0;
};
ClockError ClockErrorOf(Triad triad,
                        const MotionTrack& track,
                        const std::vector<Moment>& moments,
                        const PoseGraph& graph);

}  // namespace truetriad
