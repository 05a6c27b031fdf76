// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"

namespace truetriad {

// Restates the model and its covariance relative to another reference temperature. The modelled
// readings stay the same, while bias, sensitivity and temperature terms change. tau and t = tau - d
// are the temperatures above the old and the new reference, c_i coefficients, T' the temperature's
// rate, d' and f the linear and the cross rate term:
//
//   sum_i c_i tau^i = sum_k t^k sum_{i >= k} (i over k) d^(i - k) c_i
//   d' T' + f tau T' = (d' + f d) T' + f t T'
//
// If a sensor has the cross rate term without the linear one, returns false and changes nothing.
bool StateAbout(double reference_degc, Calibration* calibration);

}  // namespace truetriad
