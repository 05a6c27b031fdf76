// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace truetriad {

/// How the noise of a thermometer enters its smoothed track. The noise of different blocks of time
/// is independent; place i of the track has the error
///
///   sum_b sigma_b n_b degc(i, b),   its rate sum_b sigma_b n_b rate(i, b),   n_b ~ N(0, 1)
///
/// with blocks b from first[i] to first[i] + reach - 1.
struct TemperatureNoise {
  std::vector<double> sigma_degc;  ///< Of each block's mean.
  std::vector<std::size_t> first;
  std::size_t reach = 0;
  std::vector<float> degc, rate;  ///< Place after place, `reach` each; rate: 1/s.
  bool empty() const { return sigma_degc.empty(); }
};

/// Temperature over a recording, smoothed, and its rate.
struct TemperatureTrack {
  std::vector<double> time_s;  ///< Since the recording's first reading.
  std::vector<double> degc, rate_degcps;
  double smoothing_s = 0.0;  ///< Half-width of the local fits.
  double step_degc = 0.0;    ///< Step of a thermometer of coarse steps; else 0.
  TemperatureNoise noise;    ///< Empty: not known.
  bool empty() const { return time_s.empty(); }
};

}  // namespace truetriad
