// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "noise/components.h"
#include "solve/reduced_system.h"

namespace truetriad {

// A rejected observation keeps this weight: it has no influence (an error of 1000 σ moves the fit
// by 1000 * 1e-8 = 1e-5 σ), but its pose stays determined.
inline constexpr double kRejectedWeight = 1e-8;

// Test of one triad's reading at one pose, or of one turn. `chi2` is the χ² of its difference from
// the prediction by all other readings (deletion residual). It has `rank` degrees of freedom, which
// the pose's unknowns leave.
struct DeletionTest {
  NoiseComponent component = NoiseComponent::kAccelerometer;
  std::size_t node = 0;         // the pose's node; for a turn, its first node
  std::size_t observation = 0;  // index in the node; for a turn, the index of its increment
  double chi2 = 0.0;
  int rank = 0;
};
// First the tests of all observations, pose by pose, then those of the turns.
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system);

}  // namespace truetriad
