// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/known_rate_row.h"

namespace truetriad {

bool KnownRateRow::Evaluate(double const* const* parameters,
                            double* residuals,
                            double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  SetSharedJacobians(triad_blocks().ModelAt(parameters), rate_radps_, jacobians);
  return true;
}

}  // namespace truetriad
