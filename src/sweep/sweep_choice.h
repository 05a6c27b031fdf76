// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep/sweep_fit.h"
#include "sweep/sweep_problem.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The terms and lags of one axis, chosen where they were left open, and the fit with them.
struct SweepChoice {
  SweepFit fit;
  double held_out = 0.0;        // lags chosen again in every fold
  double held_out_cubic = 0.0;  // of a plain cubic
  std::vector<SweepStep> steps;
  std::vector<std::string> left_out;  // "T'^2: …why and what to do"
  // The fit with significant powers beyond a stated order; unset without.
  std::optional<SweepFit> higher;
  double moved_sigmas = 0.0;  // largest shift of a term by them in σ; σ of `fit` allow for it
};

// `wanted`: orders, rates and lags, some of them open (ThermalOptions). Terms that the recording
// cannot determine are left out and named:
//
//   a rate term   where less than a quarter of its RMS is left beside any function of temperature
//                 and the other rate terms: one rate only, or heating only
//   a lag         where heating and cooling do not determine a rate term, or where the best lag
//                 exceeds a quarter of the recording, which is drift
//
// An open order is the lowest at which no higher one is significant (p < 1 %, shared by all that
// are tried) and better for held-out blocks. Open rate terms enter and leave by the same two
// criteria. An open number of lags is the smallest whose held-out error more lags do not lower by
// 5 %.
//
// A stated order stays. Powers beyond it that lower the held-out error, and that chance would make
// in fewer than one axis of 10,000, are `higher`.
SweepChoice ChooseSweep(SweepProblem* problem, int axis, const ThermalOptions& wanted);

// "tau, tau^2, T'".
std::string TermsText(const ThermalOptions& terms);

}  // namespace truetriad
