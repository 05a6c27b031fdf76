// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Result of a test whether the tilts t of a block's faces agree with their stated σ s; the lengths
// of readings determine t. If s is right, t^T (s^2 I - P)^+ t ~ chi^2, with the covariance P of the
// estimate t.
struct TiltsSeen {
  double p_value = 1.0;
  // An upper limit of σ: if the true σ were this large, χ² would be as small as it is, or smaller,
  // in one case of ten. The limit is wide, since few lengths determine σ and FaceCurvatures is
  // quadratic in σ.
  double sigma_deg = 0.0;
};

// The result of the test if the tilts are significantly larger than stated. Unset if they are not,
// if there are no faces, if readings do not determine the tilts, or if `options` come from
// WithTilts: a second excess is chance.
std::optional<TiltsSeen> TiltsBeyondStated(const PoseGraph& graph, const CalibrateOptions& options);

// `options` with the σ of the found tilts in place of the stated one.
CalibrateOptions WithTilts(const TiltsSeen& tilts, CalibrateOptions options);

// The finding that reports larger tilts. `options`: with the stated tilts.
Finding FindingOf(const TiltsSeen& tilts, const CalibrateOptions& options);

}  // namespace truetriad
