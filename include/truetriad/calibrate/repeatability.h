// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// How much a unit's parameters change, beyond noise, from one power-up or day to the next.
struct Repeatability {
  PerTriad<double> bias{{0.0, 0.0, 0.0}};   ///< σ of each axis, true unit.
  PerTriad<double> scale{{0.0, 0.0, 0.0}};  ///< Relative σ of each gain.
};

/// Adds the repeatability to the calibration's covariance, to compare it with one of another day.
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration);

/// The calibration if gravity is exactly this value. Two calibrations from one place share the
/// error of gravity, which is then no uncertainty of their difference. Unchanged if gravity was
/// exact.
Calibration AtGravity(double gravity_mps2, Calibration calibration);

}  // namespace truetriad
