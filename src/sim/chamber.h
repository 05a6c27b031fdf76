// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "truetriad/sim/scenario.h"

namespace truetriad {

/// A temperature and how fast it changes.
struct TemperatureState {
  double degc = 25.0;
  double rate_degcps = 0.0;
};

/// The temperature of a climatic chamber over time: stretches that follow each other, after which
/// the last value is kept.
class Chamber {
 public:
  /// T(t) = start + rate t + amplitude sin(omega t), t from the beginning of the stretch.
  struct Stretch {
    double begin_s = 0.0;
    double start_degc = 25.0;
    double rate_degcps = 0.0;
    double amplitude_degc = 0.0;
    double omega_radps = 0.0;

    double At(double time_s) const;
  };

  explicit Chamber(double start_degc) { stretches_.push_back({.start_degc = start_degc}); }

  /// Each of these appends a segment at the end; the chamber holds its last value afterwards.
  void Hold(double duration_s) { end_s_ += duration_s; }
  void Ramp(const TemperatureRamp& ramp);
  void Sine(const TemperatureSine& sine);

  double end_s() const { return end_s_; }
  double end_degc() const { return stretches_.back().At(end_s_); }
  const std::vector<Stretch>& stretches() const { return stretches_; }

 private:
  void HoldFromHere(double degc) { stretches_.push_back({.begin_s = end_s_, .start_degc = degc}); }

  std::vector<Stretch> stretches_;  ///< At least one; the first begins at 0.
  double end_s_ = 0.0;
};

/// A temperature that follows the chamber's with a first-order lag, lag dT/dt = T_chamber - T, from
/// the closed-form solution in each stretch. It starts without a transient. Times must not decrease
/// between calls.
class LaggedTemperature {
 public:
  LaggedTemperature(const Chamber& chamber, double lag_s);

  TemperatureState At(double time_s);

 private:
  /// The settled response to the stretch, without the transient that earlier stretches left.
  TemperatureState Settled(const Chamber::Stretch& stretch, double time_s) const;
  TemperatureState InStretch(double time_s) const;

  std::vector<Chamber::Stretch> stretches_;
  double lag_s_;
  std::size_t current_ = 0;
  double transient_degc_ = 0.0;  ///< At the beginning of the current stretch.
};

/// The temperature of the sensing elements: the unit's, which follows the chamber, mixed with the
/// ambient thermometer's in the shares of SimulatedTemperature. Times must not decrease.
class ElementTemperature {
 public:
  ElementTemperature(const Chamber& chamber, const SimulatedTemperature& temperature)
      : unit_(chamber, temperature.element_lag_s),
        ambient_(chamber, temperature.ambient_lag_s),
        share_(temperature.element_ambient_share) {}

  TemperatureState At(double time_s);

 private:
  LaggedTemperature unit_, ambient_;
  double share_;
};

}  // namespace truetriad
