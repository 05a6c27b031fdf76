// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace truetriad {

/// How the noise of a thermometer affects its smoothed track. The noise of different blocks of time
/// is independent; the errors of temperature and rate at place i of the track are
///
///   sum_b sigma_b n_b degc(i, b)   and   sum_b sigma_b n_b rate(i, b),   n_b ~ N(0, 1)
///
/// summed over the blocks b from first[i] to first[i] + reach - 1.
struct TemperatureNoise {
  std::vector<double> sigma_degc;  ///< σ of each block's mean.
  std::vector<std::size_t> first;
  std::size_t reach = 0;
  std::vector<float> degc, rate;  ///< Weights, `reach` of them for each place i in turn; rate: 1/s.
  bool empty() const { return sigma_degc.empty(); }
};

/// The smoothed temperature over a recording, and its rate.
struct TemperatureTrack {
  std::vector<double> time_s;  ///< Since the recording's first reading.
  std::vector<double> degc, rate_degcps;
  double smoothing_s = 0.0;  ///< Half-width of the local fits.
  double step_degc = 0.0;    ///< Resolution of a thermometer if it is coarse; else 0.
  TemperatureNoise noise;    ///< Empty if the noise is unknown.
  bool empty() const { return time_s.empty(); }
};

}  // namespace truetriad
