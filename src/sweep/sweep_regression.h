// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sweep/sweep_problem.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Probability that any nonexistent term enters; shared by the candidates of the regression
// (Bonferroni), as is the level at which one leaves.
constexpr double kEnterRegression = 0.05;
// Twice the level of entry, so that no term enters and leaves endlessly.
constexpr double kLeaveRegression = 0.10;

// The full second-order regression of one axis' windows in the factors that `wanted` names: with
// five of them 1 + 5 + 15 = 21 terms (SweepRegression). No lags, no knots.
//
// Stepwise: the term of the largest partial F enters if F is beyond kEnterRegression; then those
// whose F has fallen below kLeaveRegression leave, the smallest first. The covariance behind F is
// that of the residuals of all candidates together, with their correlation. A term is not tested
// where less than a tenth of its RMS is left beside those in the regression: they would replace
// each other.
//
// The constants of the attitudes replace 1, r and r^2, which a sweep does not determine.
// Factors are divided by the largest value they take; coefficients are of the factors themselves.
SweepRegression RegressSweep(const SweepProblem& problem,
                             int axis,
                             const ThermalOptions& wanted,
                             const std::string& raw_unit);

}  // namespace truetriad
