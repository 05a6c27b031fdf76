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

// Adds the moments of a tumbling unit as nodes to a graph with a layout: each with the vector
// sensors' mean readings about it, and with the gyroscope's turn to the next. If a piece of the
// chain has one vector sensor only, nothing determines the heading about that sensor's vector, and
// the heading of the piece's first attitude is held.
void BuildMoments(const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  const std::vector<Eigen::Quaterniond>& attitudes,
                  PoseGraph* graph);

// Sets the covariances of the rows, and the robust weights of the moments. The noise of turns is
// that of raw readings, mapped by the correction of the graph's gyroscope.
void WeighMoments(const MotionNoise& noise,
                  const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  PoseGraph* graph);

std::vector<Eigen::Quaterniond> AttitudesOf(const PoseGraph& graph);

// How far a vector sensor's clock is ahead of the gyroscope's, beyond what is corrected already,
// with its σ: by regression of the residuals on how fast the field turns, dx/dt = x x omega.
struct ClockError {
  double ahead_s = 0.0;
  double sigma_s = 0.0;
};
ClockError ClockErrorOf(Triad triad,
                        const MotionTrack& track,
                        const std::vector<Moment>& moments,
                        const PoseGraph& graph);

// The noise of a tumbling unit's readings and its sources.
struct MotionNoiseState {
  MotionNoise noise;   // as used
  MotionNoise stated;  // its lower bound
  PerTriad<NoiseSource> source{};
  PerTriad<bool> is_estimated{};
  // Long-run over white variance of the residuals: 1 unless they are correlated.
  PerTriad<double> correlation{{1.0, 1.0, 1.0}};
  // Whether a hand's accelerations show. A chain as stiff as the gyroscope's white noise would take
  // their slow part for a rotation of the accelerometer in the body. The gyroscope's noise is then
  // scaled by the correlation of its residuals, so that the attitudes absorb that part (40 units
  // tumbled by hand: half the error of the angles between the sensors).
  bool is_carried = false;
};

// The noise that the experiment states, else a first estimate from the scatter of the readings
// about their neighbours.
MotionNoiseState ChooseMotionNoise(const PoseSet& poses,
                                   const CalibrateOptions& options,
                                   const StartValues& start,
                                   const MotionTrack& track);

// One round: robust weights, then variances from the squared residuals over their redundancy
// (Foerstner 1979), times the long-run ratio of the residuals along the chain, since a hand's
// accelerations are not white, and their density at low frequencies counts. Variances are never
// below `stated`. `system`: of the graph, eliminated again afterwards. Returns the largest relative
// change of a density.
double UpdateMotionNoise(const RobustOptions& robust,
                         const MotionTrack& track,
                         std::vector<Moment>* moments,
                         PoseGraph* graph,
                         ReducedSystem* system,
                         MotionNoiseState* state);

}  // namespace truetriad
