// SPDX-License-Identifier: Apache-2.0
#include "sim/chamber.h"

#include <cmath>
#include <numbers>

namespace truetriad {

double Chamber::Stretch::At(double time_s) const {
  const double t = time_s - begin_s;
  return start_degc + rate_degcps * t + amplitude_degc * std::sin(omega_radps * t);
}

void Chamber::Ramp(const TemperatureRamp& ramp) {
  const double change_degc = ramp.to_degc - end_degc();
  Stretch stretch{.begin_s = end_s_, .start_degc = end_degc()};
  stretch.rate_degcps = std::copysign(ramp.rate_degcps, change_degc);
  stretches_.push_back(stretch);
  end_s_ += std::abs(change_degc) / ramp.rate_degcps;
  HoldFromHere(ramp.to_degc);
}

void Chamber::Sine(const TemperatureSine& sine) {
  Stretch stretch{.begin_s = end_s_, .start_degc = end_degc()};
  stretch.amplitude_degc = sine.amplitude_degc;
  stretch.omega_radps = 2.0 * std::numbers::pi / sine.period_s;
  stretches_.push_back(stretch);
  end_s_ += sine.duration_s;
  HoldFromHere(stretch.At(end_s_));
}

LaggedTemperature::LaggedTemperature(const Chamber& chamber, double lag_s)
    : stretches_(chamber.stretches()), lag_s_(lag_s) {
  transient_degc_ = stretches_[0].start_degc - Settled(stretches_[0], 0.0).degc;
}

TemperatureState LaggedTemperature::Settled(const Chamber::Stretch& stretch, double time_s) const {
  const double t = time_s - stretch.begin_s;
  TemperatureState state{stretch.start_degc + stretch.rate_degcps * (t - lag_s_),
                         stretch.rate_degcps};
  if (stretch.amplitude_degc != 0.0) {
    const double omega = stretch.omega_radps;
    const double delay = omega * lag_s_;
    const double gain = stretch.amplitude_degc / (1.0 + delay * delay);
    const double sine = std::sin(omega * t);
    const double cosine = std::cos(omega * t);
    state.degc += gain * (sine - delay * cosine);
    state.rate_degcps += gain * omega * (cosine + delay * sine);
  }
  return state;
}

TemperatureState LaggedTemperature::InStretch(double time_s) const {
  const Chamber::Stretch& stretch = stretches_[current_];
  TemperatureState state = Settled(stretch, time_s);
  if (transient_degc_ != 0.0) {
    const double left = transient_degc_ * std::exp((stretch.begin_s - time_s) / lag_s_);
    state.degc += left;
    state.rate_degcps -= left / lag_s_;
  }
  return state;
}

TemperatureState LaggedTemperature::At(double time_s) {
  while (current_ + 1 < stretches_.size() && stretches_[current_ + 1].begin_s <= time_s) {
    const double begin_s = stretches_[current_ + 1].begin_s;
    const double arrived_degc = InStretch(begin_s).degc;
    ++current_;
    // Without a lag there is no transient: the difference below would be only rounding.
    transient_degc_ =
        lag_s_ > 0.0 ? arrived_degc - Settled(stretches_[current_], begin_s).degc : 0.0;
  }
  return InStretch(time_s);
}

TemperatureState ElementTemperature::At(double time_s) {
  TemperatureState state = unit_.At(time_s);
  if (share_ == 0.0) return state;
  const TemperatureState ambient = ambient_.At(time_s);
  state.degc += share_ * (ambient.degc - state.degc);
  state.rate_degcps += share_ * (ambient.rate_degcps - state.rate_degcps);
  return state;
}

}  // namespace truetriad
