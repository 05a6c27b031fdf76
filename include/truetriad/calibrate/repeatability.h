// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// By how much a unit differs from itself from run to run, beyond noise: what is different after
/// each power-up and on each day.
struct Repeatability {
  PerTriad<double> bias{{0.0, 0.0, 0.0}};   ///< σ of each axis, true unit.
  PerTriad<double> scale{{0.0, 0.0, 0.0}};  ///< Relative σ of each gain.
};

/// The calibration with a covariance that allows for it, as one of another day would.
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration);

/// The calibration as it would be, were gravity known to be so much: what two of one place have in
/// common is then no uncertainty of their difference. Unchanged where gravity was exact.
Calibration AtGravity(double gravity_mps2, Calibration calibration);

}  // namespace truetriad
