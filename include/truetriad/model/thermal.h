// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// The model of a triad at temperature T that changes at rate T' (degC/s). model.md §3:
///
///   b(T, T') = b0 + sum_i b_i tau^i + d1 T' + d2 T'^2 + f tau T'
///   S(T)     = S0 + sum_i S_i tau^i                                  tau = T - reference
///
/// `at_reference` is (S0, b0). Nothing is clamped to `thermal.range_degc`.
TriadModel<double> ModelAtTemperature(const TriadModel<double>& at_reference,
                                      const ThermalTerms& thermal,
                                      double temperature_degc,
                                      double rate_degcps = 0.0);

}  // namespace truetriad
