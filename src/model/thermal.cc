// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

double OnAxis(const std::optional<Eigen::Vector3d>& values, int axis) {
  return values ? (*values)[axis] : 0.0;
}

FirstOrderLag ElementLag(const ThermalTerms& thermal, int axis) {
  return FirstOrderLag(OnAxis(thermal.element_lag_s, axis));
}

FirstOrderLag RateLag(const ThermalTerms& thermal, int axis) {
  const double stated = OnAxis(thermal.rate_lag_s, axis);
  if (stated > 0.0) return FirstOrderLag(stated);
  return FirstOrderLag(OnAxis(thermal.element_lag_s, axis) > 0.0 ? 0.0 : thermal.smoothing_s);
}

}  // namespace

TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      double temperature_degc,
                                      double rate_degcps) {
  return ModelAtTemperature(
      at_reference,
      thermal,
      {Eigen::Vector3d::Constant(temperature_degc), Eigen::Vector3d::Constant(rate_degcps)});
}

TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      const ThermalState& state) {
  const Eigen::Array3d tau = state.degc.array() - thermal.reference_degc;
  const Eigen::Array3d rate = state.rate_degcps;
  TriadModel<double> model = at_reference;
  Eigen::Array3d power = Eigen::Array3d::Ones();
  for (const Eigen::Vector3d& term : thermal.bias) {
    power *= tau;
    model.bias.array() += power * term.array();
  }
  power.setOnes();
  for (const Eigen::Matrix3d& term : thermal.sensitivity) {
    power *= tau;
    model.sensitivity += power.matrix().asDiagonal() * term;
  }
  for (const RateTermInfo& info : kRateTerms) {
    const std::optional<Eigen::Vector3d>& term = thermal.rate[info.term];
    if (term) model.bias.array() += FactorOf(info.term, tau, rate) * term->array();
  }
  for (const ThermalKnot& knot : thermal.knots) {
    const double above = std::max(0.0, state.degc[knot.axis] - knot.degc);
    const double before = std::max(0.0, thermal.reference_degc - knot.degc);
    model.bias[knot.axis] +=
        knot.slope * (above - before) + knot.curve * (above * above - before * before);
  }
  return model;
}

double FirstOrderLag::Next(double time_s, double input) {
  if (!started_ || !(lag_s_ > 0.0)) {
    value_ = input;
  } else if (time_s > time_s_) {
    // The response to a ramp is the ramp delayed by the lag, plus the difference at the ramp's
    // start, which decays.
    const double step_s = time_s - time_s_;
    const double behind = (input - input_) / step_s * lag_s_;
    value_ = input - behind + (value_ - (input_ - behind)) * std::exp(-step_s / lag_s_);
  }
  started_ = true;
  time_s_ = time_s;
  input_ = input;
  return value_;
}

TemperatureFilter::TemperatureFilter(const ThermalTerms& thermal)
    : element_{ElementLag(thermal, 0), ElementLag(thermal, 1), ElementLag(thermal, 2)},
      rate_{RateLag(thermal, 0), RateLag(thermal, 1), RateLag(thermal, 2)} {}

const ThermalState& TemperatureFilter::Next(double time_s, double temperature_degc) {
  if (std::isnan(temperature_degc)) return state_;
  for (int axis = 0; axis < 3; ++axis) {
    FirstOrderLag& element_lag = element_[static_cast<std::size_t>(axis)];
    FirstOrderLag& rate_lag = rate_[static_cast<std::size_t>(axis)];
    const double element = element_lag.Next(time_s, temperature_degc);
    state_.degc[axis] = element;
    if (rate_lag.lag_s() > 0.0) {
      state_.rate_degcps[axis] = (element - rate_lag.Next(time_s, element)) / rate_lag.lag_s();
    } else if (element_lag.lag_s() > 0.0) {
      state_.rate_degcps[axis] = (temperature_degc - element) / element_lag.lag_s();
    }
  }
  return state_;
}

}  // namespace truetriad
