// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

// Logarithms of upper tails, by continued fractions: they stay accurate if the tail itself is below
// the smallest double, so that p of e^-5000 can be compared.

/// log P(χ² with `dof` degrees of freedom > value).
double LogChiSquareUpper(double value, double dof);

/// log P(F(dof1, dof2) > value). If dof2 is so large that F is as χ² / dof1, χ² is used.
double LogFisherUpper(double value, double dof1, double dof2);

}  // namespace truetriad
