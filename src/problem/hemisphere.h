// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Chooses one of several solutions that explain the readings equally well: (S_m, dip), or, if every
// attitude is rotated by half a turn about the vertical, (-S_m, -dip) or (S_m, pi - dip). If
// attitudes are given, the field is rotated in place of them. If poses are disturbed or missing,
// the solution may be on the wrong side of the equator, or have a dip beyond 90 degrees. If so,
// this function changes the shared parameters and the poses. It returns true if attitudes outside
// the graph must be rotated, too. The side is not changed if a prior, a held matrix or a given
// heading fixes it. If the dip is too small to determine the side, handedness decides: that of the
// magnetometer must agree with the accelerometer's and with stated mountings.
bool SettleHemisphereOfField(const CalibrateOptions& options,
                             double dip_sigma_rad,
                             PoseGraph* graph);

// Whether the magnetometer may be reversed: nothing but the stated hemisphere determines its sign.
bool MayReverse(const CalibrateOptions& options, const SharedLayout& layout);

// Increase of χ² from a stated dip with its σ if the dip changes to -dip. The readings are assumed
// to determine |dip| far better: ((dip + stated)² - (dip - stated)²) / σ² = 4 dip stated / σ².
double SideOfStatedDip(const Knowledge& stated, double dip_rad);

// Whether the dip is known (fixed or with a σ) and the reversed magnetometer may be a second
// solution.
bool MayReverseAgainstDip(const CalibrateOptions& options, const SharedLayout& layout);

// Reverses the signs of the magnetometer's matrix and of a free dip, and rotates attitudes or field
// by half a turn. If the dip is free, the predicted readings do not change. A fixed dip and a prior
// of the dip stay as they are.
void ReverseField(const CalibrateOptions& options, PoseGraph* graph);

// Whether magnetometer and accelerometer differ in handedness, after stated mountings are taken
// into account.
bool IsOfOtherHand(const CalibrateOptions& options, const PoseGraph& graph);

// Whether a dip with this σ is far enough from zero to determine the side of the equator.
bool IsSideOfEquatorTold(double dip_rad, double dip_sigma_rad);

// The attitude after a rotation by half a turn about the vertical.
Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude);

}  // namespace truetriad
