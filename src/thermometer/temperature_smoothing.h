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
/// Parabolas are fitted locally. The weights are (1 - |u|^3)^3, u being the distance in time over
/// the half-width, and outliers lose weight (Cleveland 1979). The half-width is that at which noise
/// gives the rate a σ of a hundredth of the typical rate, or a smaller one that cross-validation
/// prefers. A thermometer with coarse steps shows the temperature best when it goes from one step
/// to the next: there the temperature is half way between the two. A model of the chamber then
/// follows such places, and points on readings that stay for long (coarse_thermometer.h).
///
/// `time_s` increases; `degc` has the same length, at least kFewestSmoothed. `step_degc`: the
/// smallest step between readings; 0: not known. `hold_s`: how long each reading is repeated until
/// the next one is taken (ThermometerWatch); 0: readings are not repeated. Error (not enough): the
/// temperature does not change.
Result<TemperatureTrack> SmoothTemperature(const std::vector<double>& time_s,
                                           const std::vector<double>& degc,
                                           double step_degc,
                                           double hold_s = 0.0);

}  // namespace truetriad
