// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"

namespace truetriad {

// States bias, sensitivity and temperature terms about another temperature: the same model, its
// covariance taken along. With t = tau - d, d the shift,
//
//   sum_i c_i tau^i = sum_k t^k sum_{i >= k} (i over k) d^(i - k) c_i,   d' T' + f tau T' = (d' + f
//   d) T' + f t T'
//
// False, and nothing changed, where a cross term has no linear one to go with it.
bool StateAbout(double reference_degc, Calibration* calibration);

}  // namespace truetriad
