// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/thermal.h"

namespace truetriad {

TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      double temperature_degc,
                                      double rate_degcps) {
  const double tau = temperature_degc - thermal.reference_degc;
  TriadModel<double> model = at_reference;
  double power = 1.0;
  for (const Eigen::Vector3d& term : thermal.bias) model.bias += (power *= tau) * term;
  power = 1.0;
  for (const Eigen::Matrix3d& term : thermal.sensitivity) {
    model.sensitivity += (power *= tau) * term;
  }
  if (thermal.rate_linear) model.bias += rate_degcps * *thermal.rate_linear;
  if (thermal.rate_quadratic) model.bias += rate_degcps * rate_degcps * *thermal.rate_quadratic;
  if (thermal.rate_cross) model.bias += tau * rate_degcps * *thermal.rate_cross;
  return model;
}

}  // namespace truetriad
