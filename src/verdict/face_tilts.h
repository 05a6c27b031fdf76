// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/model/finding.h"
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

// The tilts where they are evidently larger than was stated. Unset without faces, where readings
// tell nothing of their tilts, and where `options` have them from here already: what is left then
// is chance.
std::optional<TiltsSeen> TiltsBeyondStated(const PoseGraph& graph, const CalibrateOptions& options);

// `options` that take them for as large as they were seen.
CalibrateOptions WithTilts(const TiltsSeen& tilts, CalibrateOptions options);

// Says so. `options`: as stated.
Finding FindingOf(const TiltsSeen& tilts, const CalibrateOptions& options);

}  // namespace truetriad
