// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/thermometer/temperature_track.h"

namespace truetriad {

/// What a thermometer of coarse steps says for certain: where it goes from one step to the next the
/// temperature is half way between. Inside of a step that lasts long it is somewhere in it, which
/// `sigma_degc` says; 0: a place of change.
struct StepPlaces {
  std::vector<double> time_s, degc, sigma_degc;
  void Add(double time, double value, double sigma) {
    time_s.push_back(time), degc.push_back(value), sigma_degc.push_back(sigma);
  }
};

/// `time_s` increases; `degc`: readings, or means of some of them, in multiples of `step_degc` from
/// any base. Noise that goes to and fro over the same place is one change.
StepPlaces PlacesOfChange(const std::vector<double>& time_s,
                          const std::vector<double>& degc,
                          double step_degc);

/// The temperature and its rate at `time_s` through such places, at least four, of which two
/// differ. A board follows its chamber with a lag, and a chamber goes straight from one setting to
/// the next, or nearly:
///
///   lag T' = C - T,    C' = a walk of small steps + a few large ones (kinks)
///
/// or behind two lags, as of the air in the chamber and the board in the air.
/// Between places only this says how the temperature turns. Lag, kinks, the size of the small steps
/// and σ of the places are those of the largest posterior: Kalman filter, disturbance smoother, and
/// kinks added as long as they raise it (de Jong and Penzer 1998). Lag 0 without kinks is a cubic
/// smoothing spline.
TemperatureTrack ThroughPlaces(const StepPlaces& places, const std::vector<double>& time_s);

}  // namespace truetriad
