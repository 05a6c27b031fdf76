// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"

namespace truetriad {

// Restates the same model and its covariance for another reference temperature: bias, sensitivity
// and temperature terms change. If the reference rises by d, t = tau - d, and
//
//   sum_i c_i tau^i = sum_k t^k sum_{i >= k} (i over k) d^(i - k) c_i
//   d' T' + f tau T' = (d' + f d) T' + f t T'
//
// If a sensor has the cross rate term without the linear one, returns false and changes nothing.
bool StateAbout(double reference_degc, Calibration* calibration);

}  // namespace truetriad
