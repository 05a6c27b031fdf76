// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include <Eigen/Core>

#include "sweep/sweep_fit.h"
#include "sweep/sweep_problem.h"

namespace truetriad {

// What the noise of the thermometer does to the fitted readings, to first order: for each
// independent part of the noise, of 1 sigma, what it adds to each window. Temperature and rate go
// through the lags of the fit. One after another: all of them may be more than memory is used for.
void ForEachTemperatureError(const SweepProblem& problem,
                             const SweepFit& fit,
                             const std::function<void(const Eigen::VectorXd&)>& note);

}  // namespace truetriad
