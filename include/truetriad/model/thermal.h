// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "truetriad/model/calibration.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// The temperature that governs each axis of a triad, and its rate.
struct ThermalState {
  Eigen::Vector3d degc = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_degcps = Eigen::Vector3d::Zero();
};

/// The model of a triad at temperature T that changes at rate T' (degC/s); docs/method.md,
/// "Temperature":
///
///   b(T, T') = b0 + sum_i b_i tau^i + d1 T' + d2 T'^2 + f tau T'
///   S(T)     = S0 + sum_i S_i tau^i                                  tau = T - reference
///
/// `at_reference` is (S0, b0). The temperature is not clamped to `thermal.range_degc`.
TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      double temperature_degc,
                                      double rate_degcps = 0.0);

/// As above, with a temperature and a rate of its own for each axis (row of S).
TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      const ThermalState& state);

/// A first-order lag, lag dy/dt = x - y; exact if the input is linear between readings. The output
/// starts at the first input. If the lag is 0, the output is the input.
class FirstOrderLag {
 public:
  explicit FirstOrderLag(double lag_s) : lag_s_(lag_s) {}
  double Next(double time_s, double input);
  double lag_s() const { return lag_s_; }

 private:
  double lag_s_;
  double time_s_ = 0.0, input_ = 0.0, value_ = 0.0;
  bool started_ = false;
};

/// Computes the temperature and the rate of each axis from a thermometer's reading T:
///
///   element temperature  E: lag_e E' = T - E            lag_e = 0: E = T
///   its rate             (E - F) / lag_r,  lag_r F' = E - F
///
/// (E - F) / lag_r is E' behind a first-order lag. If lag_r is 0, the rate is E' = (T - E) / lag_e;
/// if lag_e is 0, too, lag_r is `smoothing_s`.
class TemperatureFilter {
 public:
  explicit TemperatureFilter(const ThermalTerms& thermal);
  /// Times must not decrease; a temperature of NaN leaves the state unchanged.
  const ThermalState& Next(double time_s, double temperature_degc);

 private:
  std::array<FirstOrderLag, 3> element_, rate_;
  ThermalState state_;
};

}  // namespace truetriad
