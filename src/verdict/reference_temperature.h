// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"

namespace truetriad {

// Transforms bias, sensitivity and temperature terms to another reference temperature: the same
// model with its covariance. With t = tau - d, d the shift,
//
//   sum_i c_i tau^i = sum_k t^k sum_{i >= k} (i over k) d^(i - k) c_i
//   d' T' + f tau T' = (d' + f d) T' + f t T'
//
// Returns false, with no change, if a sensor's cross rate term lacks the linear one.
bool StateAbout(double reference_degc, Calibration* calibration);

}  // namespace truetriad
