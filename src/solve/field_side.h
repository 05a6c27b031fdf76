// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The excess of χ² that makes one of two solutions a thousand times less likely: 2 log 1000 if the
// noise is known, more if its estimate has `noise_dof` degrees of freedom (Student's t).
double FarInChi2(double noise_dof);

// A second solution, with the magnetometer reversed and the field on the other side of the
// horizontal.
struct OtherSide {
  PoseGraph graph;
  double worse = 0.0;  // its χ² minus that of the first solution

  // Whether χ² decides which of the two solutions is true.
  bool IsTold(double noise_dof) const;
};

// The solution with the field on the other side of the horizontal. Unset if the dip is unknown,
// since both sides are then the same solution (hemisphere.h). Also unset if the magnetometer's sign
// is held, if there is no accelerometer, or if the dip is far from 0.
std::optional<OtherSide> OtherSideOfField(const CalibrateOptions& options, const PoseGraph& solved);

// Moves the field to its true side and returns whether it moved. If OtherSideOfField returns a
// solution, the likelier side is taken; if χ² does not decide, handedness decides. Otherwise
// SettleHemisphereOfField decides.
bool SettleField(const CalibrateOptions& options, double noise_dof, PoseGraph* graph);

}  // namespace truetriad
