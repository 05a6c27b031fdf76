// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// How much a unit's parameters change between runs beyond noise, that is after each power-up and
/// from day to day.
struct Repeatability {
  PerTriad<double> bias{{0.0, 0.0, 0.0}};   ///< σ of each axis, true unit.
  PerTriad<double> scale{{0.0, 0.0, 0.0}};  ///< Relative σ of each gain.
};

/// Adds the repeatability to the calibration's covariance, for comparison with another day's.
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration);

/// The calibration conditioned on this value of gravity: gravity's error, which two calibrations of
/// one place share, is then no uncertainty of their difference. Unchanged if gravity was exact.
Calibration AtGravity(double gravity_mps2, Calibration calibration);

}  // namespace truetriad
