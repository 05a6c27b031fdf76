// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "verdict/own_residuals.h"

namespace truetriad {

// Rests that begin before the unit, or what its sensor's filter holds back, has come to rest, and
// what that does to the solution.
struct Settling {
  double p_value = 1.0;
  double effect_sigmas = 0.0;
  std::optional<double> kappa;  // as of LeftOutTest
  Eigen::VectorXd moved;        // the free coordinates, by it
  Eigen::MatrixXd covariance;   // of that
};

// By one number h for all poses a vector sensor's means lie towards those of the pose before,
//
//   mean_k = f_k + h (f_k-1 - f_k)
//
// The score test of h; unset where too few poses tell of it.
std::optional<Settling> FindSettling(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const OwnResiduals& own,
                                     Triad triad);

// Turns that go on into the rests: what the gyroscope reads in the first quarter of a rest, beyond
// its middle half, about the axis of the turn before, and in the last quarter about that of the
// next. By the mean angle of it all turns are too short, however large they are. Unset where too
// few rests tell of it.
std::optional<Settling> FindUnsettledTurns(const PoseSet& poses,
                                           const PoseGraph& graph,
                                           const ReducedSystem& system);

}  // namespace truetriad
