// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The excess of χ² that makes one of two solutions a thousand times less likely: 2 log 1000 if the
// noise is known, more if its estimate has `noise_dof` degrees of freedom (Student's t).
double FarInChi2(double noise_dof);

// A solution with the magnetometer reversed, the field on the other side of the horizontal.
struct OtherSide {
  PoseGraph graph;
  double worse = 0.0;  // its χ² minus that of the first solution

  // Whether χ² decides which of the two is true.
  bool IsTold(double noise_dof) const;
};

// The other side's solution, if the dip is known, fixed or with a σ, and near enough to the
// horizontal that this is possible. Without a known dip both sides are one solution (hemisphere.h).
std::optional<OtherSide> OtherSideOfField(const CalibrateOptions& options, const PoseGraph& solved);

// Moves the field to its true side; false if it was there already. Without a known dip both sides
// are one solution, else the likelier one is taken.
bool SettleField(const CalibrateOptions& options, double noise_dof, PoseGraph* graph);

}  // namespace truetriad
