// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/graph.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Labels the same solution by the field that is there. (S_m, dip), (-S_m, -dip) and (S_m, pi - dip)
// explain the same readings with every attitude, or where those are given the field, turned half a
// turn about the vertical. A start that disturbed or missing poses have spoilt may have ended on
// the wrong side of the equator, or with a dip beyond 90 degrees: then this changes the shared
// parameters and the poses; true says that attitudes which the graph does not hold are to be turned
// with them. The side of the equator stays where something else knows north from south; where the
// dip does not tell it, the side is the one on which the magnetometer has the hand that is stated,
// or the accelerometer's.
bool SettleHemisphereOfField(const CalibrateOptions& options,
                             double dip_sigma_rad,
                             PoseGraph* graph);

// Whether that may reverse the magnetometer: nothing but the hemisphere knows the sign.
bool MayReverse(const CalibrateOptions& options, const SharedLayout& layout);

// By how much more χ² a stated dip and σ let the other side of a dip cost, where readings tell it
// far better: (dip + stated)² - (dip - stated)² over σ².
double SideOfStatedDip(const Knowledge& stated, double dip_rad);

// Whether the field's other side is to be weighed against a dip that is known, fixed or with a σ.
bool MayReverseAgainstDip(const CalibrateOptions& options, const SharedLayout& layout);

// The magnetometer's negative, with the field on the other side of the horizontal: readings stay
// where the dip is free; what is known of it, or holds it, does not follow.
void ReverseField(const CalibrateOptions& options, PoseGraph* graph);

// Whether the magnetometer is of the other hand than it is built: as is stated, else the
// accelerometer's.
bool IsOfOtherHand(const CalibrateOptions& options, const PoseGraph& graph);

// Whether a dip tells on which side of the equator it is.
bool IsSideOfEquatorTold(double dip_rad, double dip_sigma_rad);

// As those are turned.
Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude);

}  // namespace truetriad
