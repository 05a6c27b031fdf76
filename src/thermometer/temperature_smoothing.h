// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/thermometer/temperature_track.h"

namespace truetriad {

/// A local parabola has three unknowns; a fourth reading leaves one degree of freedom.
inline constexpr std::size_t kFewestSmoothed = 4;

/// Temperature and its rate from means of a thermometer's readings over short cells of time.
///
/// A parabola is fitted locally with weights (1 - |u|^3)^3, and outliers lose weight (Cleveland
/// 1979). The half-width is the one at which noise adds a hundredth of the typical rate to the
/// rate, or a smaller one by cross-validation. A thermometer of coarse steps gives its information
/// when it goes from one step to the next, where the temperature is half way between the two: a
/// model of the chamber follows such places, and points inside steps that last long
/// (coarse_thermometer.h).
///
/// `time_s` increases; `time_s` and `degc` have one length, at least kFewestSmoothed. `step_degc`:
/// the smallest step between readings; 0: not known. `hold_s`: how long each reading is repeated
/// until the next one is taken (ThermometerWatch); 0: not at all. Error (not enough): the
/// temperature does not change.
Result<TemperatureTrack> SmoothTemperature(const std::vector<double>& time_s,
                                           const std::vector<double>& degc,
                                           double step_degc,
                                           double hold_s = 0.0);

}  // namespace truetriad
