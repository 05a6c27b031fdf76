// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Chooses one of several descriptions of the same solution. (S_m, dip), (-S_m, -dip) and
// (S_m, pi - dip) explain the same readings if every attitude (or, where those are given, the
// field) is turned half a turn about the vertical. A start from disturbed or missing poses may have
// ended on the wrong side of the equator, or with a dip beyond 90 degrees: then this changes the
// shared parameters and the poses, and returns true if attitudes outside the graph are to be
// turned, too. The side of the equator is not changed where a prior, a held matrix or a given
// heading fixes it. Where the dip does not determine the side, it is the one on which the
// magnetometer has the stated handedness, or else the accelerometer's.
bool SettleHemisphereOfField(const CalibrateOptions& options,
                             double dip_sigma_rad,
                             PoseGraph* graph);

// Whether it may reverse the magnetometer: only the stated hemisphere determines the sign.
bool MayReverse(const CalibrateOptions& options, const SharedLayout& layout);

// How much more χ² the other side of a dip costs against a stated dip and σ, if readings determine
// |dip| far better: ((dip + stated)² - (dip - stated)²) / σ² = 4 dip stated / σ².
double SideOfStatedDip(const Knowledge& stated, double dip_rad);

// Whether the other sign of the field is to be compared with a known dip, fixed or with a σ.
bool MayReverseAgainstDip(const CalibrateOptions& options, const SharedLayout& layout);

// Reverses the magnetometer, with the field on the other side of the horizontal: predicted readings
// stay where the dip is free; its prior, or a fixed dip, does not follow.
void ReverseField(const CalibrateOptions& options, PoseGraph* graph);

// Whether the magnetometer has the other handedness than stated, or else than the accelerometer.
bool IsOfOtherHand(const CalibrateOptions& options, const PoseGraph& graph);

// Whether a dip determines on which side of the equator it is.
bool IsSideOfEquatorTold(double dip_rad, double dip_sigma_rad);

// The attitude turned half a turn about the vertical.
Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude);

}  // namespace truetriad
