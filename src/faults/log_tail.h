// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

// Logarithms of upper tail probabilities, by continued fractions. They stay accurate even if the
// probability itself is below the smallest double, so that p of e^-5000 can be compared.

/// log P(χ² with `dof` degrees of freedom > value).
double LogChiSquareUpper(double value, double dof);

/// log P(F(dof1, dof2) > value). If dof2 is above 1e5, the limit χ² / dof1 of F is used.
double LogFisherUpper(double value, double dof1, double dof2);

}  // namespace truetriad
