// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "motion/track.h"
#include "problem/graph.h"
#include "problem/start_values.h"
#include "solve/reduced_system.h"
#include "truetriad/problem/options.h"

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

// Where the noise of a tumbling unit's readings comes from. What is stated is of one reading.
struct MotionNoiseState {
  MotionNoise noise;   // as used
  MotionNoise stated;  // what it is at least
  PerTriad<NoiseSource> source{};
  PerTriad<bool> is_estimated{};
  // Long-run over white variance of the residuals: 1 unless they hang together.
  PerTriad<double> correlation{{1.0, 1.0, 1.0}};
  // A hand's accelerations show. A chain as stiff as the gyroscope is good would take their slow
  // part for the accelerometer's attitude in the body. The gyroscope's noise then counts by how its
  // residuals are correlated, so that the attitudes take that part up (40 units tumbled by hand:
  // half the error of the angles between the sensors).
  bool is_carried = false;
};

// What the experiment states; else a first guess from how the readings scatter about their
// neighbours.
MotionNoiseState ChooseMotionNoise(const PoseSet& poses,
                                   const CalibrateOptions& options,
                                   const StartValues& start,
                                   const MotionTrack& track);

// One round: robust weights, then variances by their residuals over what the attitudes leave of
// them (Foerstner 1979), times how much the residuals hang together from one attitude to the next:
// a hand's accelerations are no white noise, and what counts is their density at low frequencies.
// Never below what is stated. `system`: of the graph, which it is of again afterwards. Returns the
// largest relative change of a density.
double UpdateMotionNoise(const RobustOptions& robust,
                         const MotionTrack& track,
                         std::vector<Moment>* moments,
                         PoseGraph* graph,
                         ReducedSystem* system,
                         MotionNoiseState* state);

}  // namespace truetriad
