// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// By how much a unit differs from itself from run to run, beyond noise: what is different after
/// each power-up and on each day.
struct Repeatability {
  PerTriad<double> bias{{0.0, 0.0, 0.0}};   ///< σ of each axis, true unit.
  PerTriad<double> scale{{0.0, 0.0, 0.0}};  ///< Relative σ of each gain.
};

/// Of "accelerometer.bias=0.01", "gyroscope.scale=1e-4". Error (usage): anything else.
Result<Repeatability> ParseRepeatability(const std::vector<std::string>& items);

/// The calibration with a covariance that allows for it, as one of another day would.
Calibration WithRepeatability(const Repeatability& repeatability, Calibration calibration);

}  // namespace truetriad
