// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Test of the tilts of a block's faces, as the lengths of readings determine them, against their
// stated σ: with prior covariance s^2 I and covariance P of the estimate t,
// t^T (s^2 I - P)^+ t ~ chi^2.
struct TiltsSeen {
  double p_value = 1.0;
  // A safe upper value of σ: if it were true, χ² would be as small as it is in one case of ten. Few
  // lengths determine it, and FaceCurvatures is quadratic in it.
  double sigma_deg = 0.0;
};

// The tilts if they are significantly larger than stated. Unset without faces, if readings do not
// determine their tilts, and if `options` are already WithTilts: what remains is chance.
std::optional<TiltsSeen> TiltsBeyondStated(const PoseGraph& graph, const CalibrateOptions& options);

// `options` with the found tilts.
CalibrateOptions WithTilts(const TiltsSeen& tilts, CalibrateOptions options);

// The finding about larger tilts. `options`: as stated, without them.
Finding FindingOf(const TiltsSeen& tilts, const CalibrateOptions& options);

}  // namespace truetriad
