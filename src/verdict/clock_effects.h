// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/model/quality.h"

namespace truetriad {

// What clocks that differ do to a solution.
struct ClockEffects {
  // Of each offset: by how many σ some parameter is off for it at most.
  std::vector<double> sigmas;
  // What all of them make the free shared coordinates less certain by.
  Eigen::MatrixXd covariance;
};

// A clock that is late by d changes the mean of a rest by d times what the readings at its ends
// differ by over its duration, and the forces that a g-sensitivity sees during a turn. With y those
// changes for one second, the free coordinates move by
//
//   m = M^-1 J^T D y d      and are less certain by      m m^T (1 + σ^2 / d^2),
//
// which is next to nothing where rests are still to their ends.
ClockEffects EffectsOf(const std::vector<ClockOffset>& offsets,
                       const PoseGraph& graph,
                       const ReducedSystem& system);

}  // namespace truetriad
