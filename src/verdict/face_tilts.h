// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The tilts of a block's faces as the lengths of the readings show them, against the σ that was
// stated for them: with prior covariance s^2 I and covariance P of the estimate t,
// t^T (s^2 I - P)^+ t ~ chi^2 under it.
struct TiltsSeen {
  double p_value = 1.0;
  // What it may well be: χ² would be smaller by chance in one case of ten. Few lengths tell of it,
  // and what it is too small by counts twice in TiltCurvature.
  double sigma_deg = 0.0;
};

// Unset without faces, or where readings tell nothing of their tilts.
std::optional<TiltsSeen> TiltsAgainstStated(const PoseGraph& graph,
                                            const ReducedSystem& system,
                                            const AttitudeOptions& attitudes);

// Covariance of the free shared coordinates by what linearisation leaves out: a face that is
// tilted by t more than thought reads t^2 / 2 less along its axis.
Eigen::MatrixXd TiltCurvature(const PoseGraph& graph, const ReducedSystem& system);

}  // namespace truetriad
