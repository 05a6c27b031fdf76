// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "verdict/checks/constancy.h"
#include "verdict/checks/soak.h"
#include "verdict/clock_effects.h"
#include "verdict/left_out_terms.h"
#include "verdict/time_blocks.h"

namespace truetriad {

// What a recording shows that the model does not have: all of it makes the solution less certain.
struct Unmodelled {
  DriftCovariance drift;
  LeftOutTerms left_out;
  BlockScatter blocks;
  std::vector<ClockOffset> clocks;  // beyond what was taken off
  ClockEffects by_clocks;           // in the order of `clocks`
  std::optional<MagnetometerChange> change;
  bool change_is_drift = false;    // which `drift` has counted
  Eigen::MatrixXd tilt_curvature;  // of the free shared coordinates

  // Of the free shared coordinates.
  Eigen::MatrixXd Covariance() const;
};

// `settings`: of the graph.
Unmodelled FindUnmodelled(const PoseSet& poses,
                          const PoseGraph& graph,
                          const ReducedSystem& system,
                          const NoiseState& noise,
                          const CalibrateOptions& options,
                          const std::vector<TemperatureSetting>& settings);

}  // namespace truetriad
