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

// Noise densities of a tumbling unit's readings, per axis, in raw unit squared times seconds. At
// the frequencies that matter the noise is white: a mean over T seconds has variance density / T.
struct MotionNoise {
  PerTriad<Eigen::Vector3d> density;
};

// Makes the moments of a tumbling unit the nodes of a graph that has a layout. A node has the
// vector sensors' mean readings about it and the gyroscope's turn to the next node. If a piece of
// the chain has one vector sensor only, nothing determines the heading about that sensor's vector,
// and the heading of the piece's first attitude is held.
void BuildMoments(const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  const std::vector<Eigen::Quaterniond>& attitudes,
                  PoseGraph* graph);

// Sets the covariances of the rows, and the robust weights of the moments. The noise of a turn is
// that of the raw readings, converted by the correction of the graph's gyroscope.
void WeighMoments(const MotionNoise& noise,
                  const MotionTrack& track,
                  const std::vector<Moment>& moments,
                  PoseGraph* graph);

std::vector<Eigen::Quaterniond> AttitudesOf(const PoseGraph& graph);

// By how much a vector sensor's clock is ahead of the gyroscope's, beyond what is corrected
// already, and the σ of this.
struct ClockError {
  double ahead_s = 0.0;
  double sigma_s = 0.0;
};
// Both clocks' errors h by generalised least squares, together with the attitudes and all
// parameters, which P of `system` eliminates: h = -(Z^T P Z)^-1 Z^T P r. A reading that is stamped
// h too late shows the field x of h earlier, so that Z = S (omega x x). σ is zero if a sensor is
// missing or its field does not change.
PerTriad<ClockError> ClockErrorsOf(const std::vector<Moment>& moments,
                                   const PoseGraph& graph,
                                   const ReducedSystem& system);

// The noise of a tumbling unit's readings and its sources.
struct MotionNoiseState {
  MotionNoise noise;   // as used
  MotionNoise stated;  // the lower bound of `noise`
  // If no noise is stated: what the readings' differences show. No turn is known better than its
  // readings' own noise allows, however well a chain of attitudes fits it, and the estimate of one
  // of several variances of a chain now and then collapses to zero. So this is a lower bound, too,
  // unless differences contain fast motion: if an estimate is lower by 4 of its sampling errors, 2
  // / sqrt(redundancy), the bound is zero from then on.
  MotionNoise seen;
  PerTriad<NoiseSource> source{};
  PerTriad<bool> is_estimated{};
  // Long-run variance of the residuals divided by their white variance: 1 unless they are
  // correlated.
  PerTriad<double> correlation{{1.0, 1.0, 1.0}};
  // Whether a hand's accelerations show. A chain as stiff as the gyroscope's white noise would
  // mistake their slow part for a rotation of the accelerometer in the body. The gyroscope's noise
  // is then scaled by the correlation of its residuals, so that the attitudes absorb that part (40
  // units tumbled by hand: half the error of the angles between the sensors).
  bool is_carried = false;
};

// The noise that the experiment states. If it states none: a first estimate from the scatter of the
// readings about their neighbours.
MotionNoiseState ChooseMotionNoise(const PoseSet& poses,
                                   const CalibrateOptions& options,
                                   const StartValues& start,
                                   const MotionTrack& track);

// One round: updates the robust weights, then the variances, as the squared residuals divided by
// their redundancy (Foerstner 1979). The variances are multiplied by the residuals' long-run ratio
// along the chain: a hand's accelerations are not white, and their density at low frequencies
// counts. Variances are never below `stated` and `seen`. `system` is that of the graph and is
// eliminated again at the end. Returns the largest relative change of a density.
double UpdateMotionNoise(const RobustOptions& robust,
                         const MotionTrack& track,
                         std::vector<Moment>* moments,
                         PoseGraph* graph,
                         ReducedSystem* system,
                         MotionNoiseState* state);

}  // namespace truetriad
