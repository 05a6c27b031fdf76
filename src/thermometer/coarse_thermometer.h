// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/thermometer/temperature_track.h"

namespace truetriad {

/// Places are times at which a thermometer with coarse steps determines the temperature. Where the
/// reading goes from one step to the next, the temperature is half way between the two;
/// `sigma_degc` is then 0: unknown. Where a reading stays for long, the temperature is within half
/// a step of the reading; `sigma_degc` then follows from step / √12.
struct StepPlaces {
  std::vector<double> time_s, degc, sigma_degc;
  void Add(double time, double value, double sigma) {
    time_s.push_back(time), degc.push_back(value), sigma_degc.push_back(sigma);
  }
};

/// Finds the places (see StepPlaces) of a thermometer's readings. `time_s` increases. `degc` are
/// readings, or means of a few readings; readings differ by multiples of `step_degc`. If noise
/// makes the reading cross one place repeatedly, this counts as one change.
StepPlaces PlacesOfChange(const std::vector<double>& time_s,
                          const std::vector<double>& degc,
                          double step_degc);

/// The temperature and its rate at `time_s`, from at least four places with at least two different
/// temperatures. The board's temperature T follows that of the chamber, C, with a lag, and the
/// chamber goes from one setting to the next along nearly straight ramps:
///
///   lag T' = C - T,    C' = a walk of small steps + a few large ones (kinks)
///
/// Between places, only this model gives the temperature. Lag, kinks, the size of the small steps
/// and the σ of the places are those with the largest posterior, which a Kalman filter and a
/// disturbance smoother find. Kinks are added as long as they raise the posterior (de Jong and
/// Penzer 1998). With lag 0 and no kinks, the result is a cubic smoothing spline.
TemperatureTrack ThroughPlaces(const StepPlaces& places, const std::vector<double>& time_s);

}  // namespace truetriad
