// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// One solution is a thousand times as likely as another: 2 log 1000.
inline constexpr double kFarInChi2 = 13.8;

// A solution with the magnetometer's negative and the field on the other side of the horizontal.
struct OtherSide {
  PoseGraph graph;
  double worse = 0.0;  // χ² above that of the first

  // Whether it tells which of the two it is.
  bool IsTold() const { return !(worse < kFarInChi2 && worse > -kFarInChi2); }
};

// Where a dip is known, fixed or with a σ, near enough to the horizontal that the other side might
// be the one: solved from there. Without a known dip both sides are one solution (hemisphere.h).
std::optional<OtherSide> OtherSideOfField(const CalibrateOptions& options, const PoseGraph& solved);

}  // namespace truetriad
