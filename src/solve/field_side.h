// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// From which χ² on, above that of another, one of two solutions is a thousand times less likely:
// 2 log 1000 where the noise is known, more where so many degrees of freedom tell it (Student's t).
double FarInChi2(double noise_dof);

// A solution with the magnetometer's negative and the field on the other side of the horizontal.
struct OtherSide {
  PoseGraph graph;
  double worse = 0.0;  // χ² above that of the first

  // Whether it tells which of the two it is.
  bool IsTold(double noise_dof) const;
};

// Where a dip is known, fixed or with a σ, near enough to the horizontal that the other side might
// be the one: solved from there. Without a known dip both sides are one solution (hemisphere.h).
std::optional<OtherSide> OtherSideOfField(const CalibrateOptions& options, const PoseGraph& solved);

// The field on the side where it is; false where it was there. Without a known dip that is the same
// solution, else another one, and the likelier.
bool SettleField(const CalibrateOptions& options, double noise_dof, PoseGraph* graph);

}  // namespace truetriad
