// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sweep/sweep_problem.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The probability that some nonexistent term enters. Like kLeaveRegression, it is divided among the
// candidates of the regression (Bonferroni).
constexpr double kEnterRegression = 0.05;
// The level at which a term leaves: twice the level of entry, so that no term enters and leaves
// endlessly.
constexpr double kLeaveRegression = 0.10;

// The full second-order regression of one axis' windows in the factors that `wanted` names: with
// five of them 1 + 5 + 15 = 21 terms (SweepRegression). No lags, no knots.
//
// Stepwise: the term of the largest partial F enters if F is significant at kEnterRegression; then
// terms that are no longer significant at kLeaveRegression leave, the smallest F first. F uses the
// covariance of the residuals of a fit with all candidates, including their correlation. If less
// than a tenth of a term's RMS is independent of the terms in the regression, it is not tested: it
// could replace one of them.
//
// The constants of the attitudes replace 1, r and r^2, which a sweep does not determine. Factors
// are divided by their largest value in the fit; results are stated for factors without this
// division.
SweepRegression RegressSweep(const SweepProblem& problem,
                             int axis,
                             const ThermalOptions& wanted,
                             const std::string& raw_unit);

}  // namespace truetriad
