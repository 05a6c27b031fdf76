// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Chooses one of several solutions that explain the readings equally well: (S_m, dip), (-S_m, -dip)
// and (S_m, pi - dip) do so if every attitude (or the field, if attitudes are given) is rotated by
// half a turn about the vertical. A start from disturbed or missing poses may have ended on the
// wrong side of the equator, or with a dip beyond 90 degrees: then this function changes the shared
// parameters and the poses, and returns true if attitudes outside the graph are to be rotated, too.
// The side of the equator is not changed if a prior, a held matrix or a given heading fixes it. If
// the dip does not determine the side, the chosen side is the one on which the magnetometer has the
// stated handedness, or else the accelerometer's.
bool SettleHemisphereOfField(const CalibrateOptions& options,
                             double dip_sigma_rad,
                             PoseGraph* graph);

// Whether the magnetometer may be reversed: nothing but the stated hemisphere determines its sign.
bool MayReverse(const CalibrateOptions& options, const SharedLayout& layout);

// The increase of χ² from dip to -dip due to a stated dip and its σ, if the readings determine
// |dip| far better: ((dip + stated)² - (dip - stated)²) / σ² = 4 dip stated / σ².
double SideOfStatedDip(const Knowledge& stated, double dip_rad);

// Whether the reversed magnetometer is to be tried against a known dip, which is fixed or has a σ.
bool MayReverseAgainstDip(const CalibrateOptions& options, const SharedLayout& layout);

// Reverses the signs of the magnetometer's matrix and of a free dip, and rotates attitudes or field
// by half a turn: predicted readings stay if the dip is free; its prior, or a fixed dip, stays,
// too.
void ReverseField(const CalibrateOptions& options, PoseGraph* graph);

// Whether magnetometer and accelerometer differ in handedness, with their stated mountings.
bool IsOfOtherHand(const CalibrateOptions& options, const PoseGraph& graph);

// Whether a dip with this σ is far enough from zero to determine the side of the equator.
bool IsSideOfEquatorTold(double dip_rad, double dip_sigma_rad);

// The attitude turned half a turn about the vertical.
Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude);

}  // namespace truetriad
