// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

// Logarithms of upper tails, by continued fractions: they keep their digits where the tail itself
// is below the smallest double, so that findings of e^-5000 can still be compared.

/// log P(χ² with `dof` degrees of freedom > value).
double LogChiSquareUpper(double value, double dof);

/// log P(F(dof1, dof2) > value); χ² / dof1 where dof2 is so large that nothing differs.
double LogFisherUpper(double value, double dof1, double dof2);

}  // namespace truetriad
