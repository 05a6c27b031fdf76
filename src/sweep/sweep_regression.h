// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sweep/sweep_problem.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Level at which any term enters that is not there, and above which one leaves again; both are
// shared by the candidates of the regression (Bonferroni).
constexpr double kEnterRegression = 0.05;
// Twice the level of entry, so that no term enters and leaves for ever.
constexpr double kLeaveRegression = 0.10;

// The full second-order regression of one axis' windows in the factors that `wanted` names: with
// five of them 1 + 5 + 15 = 21 terms (SweepRegression). No lags, no knots.
//
// Stepwise: the term of the largest partial F enters if F is beyond kEnterRegression; then those
// whose F has fallen below kLeaveRegression leave, the smallest first. F is that of an estimate
// whose covariance is that of what all candidates together leave, correlated as it is. Terms of
// which less than a tenth is their own, beside those that are in it, are not tested: they would
// stand for each other.
//
// The constants of the attitudes take the place of 1, r and r^2: a sweep does not tell these three.
// Factors are divided by the largest value they take; coefficients are of the factors themselves.
SweepRegression RegressSweep(const SweepProblem& problem,
                             int axis,
                             const ThermalOptions& wanted,
                             const std::string& raw_unit);

}  // namespace truetriad
