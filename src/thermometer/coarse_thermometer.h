// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/thermometer/temperature_track.h"

namespace truetriad {

/// Places are times at which a thermometer of coarse steps determines the temperature. When the
/// reading goes from one step to the next, the temperature is half way between; `sigma_degc` is 0:
/// unknown. Inside a step that lasts long it is within the step, with `sigma_degc` from step / √12.
struct StepPlaces {
  std::vector<double> time_s, degc, sigma_degc;
  void Add(double time, double value, double sigma) {
    time_s.push_back(time), degc.push_back(value), sigma_degc.push_back(sigma);
  }
};

/// `time_s` increases; `degc`: readings, or means of some of them, in multiples of `step_degc` from
/// any base. Repeated crossings of one place by noise count as one change.
StepPlaces PlacesOfChange(const std::vector<double>& time_s,
                          const std::vector<double>& degc,
                          double step_degc);

/// The temperature and its rate at `time_s` through at least four such places, of which two differ.
/// The board's temperature T follows the chamber's C with a lag, and the chamber goes from one
/// setting to the next along nearly straight ramps:
///
///   lag T' = C - T,    C' = a walk of small steps + a few large ones (kinks)
///
/// or with two lags in series, such as those of the chamber's air and of the board in the air.
/// Only this model gives the temperature between places. Lags, kinks, the size of the small steps
/// and σ of the places are those of the largest posterior, found by Kalman filter and disturbance
/// smoother; kinks are added as long as they raise it (de Jong and Penzer 1998). Lag 0 without
/// kinks is a cubic smoothing spline.
TemperatureTrack ThroughPlaces(const StepPlaces& places, const std::vector<double>& time_s);

}  // namespace truetriad
