// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep/sweep_fit.h"
#include "sweep/sweep_problem.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// The terms and lags of one axis, chosen if the options leave them open, and the fit with them.
struct SweepChoice {
  SweepFit fit;
  double held_out = 0.0;        // held-out RMS; the lags are chosen again in every fold
  double held_out_cubic = 0.0;  // held-out RMS of a plain cubic
  std::vector<SweepStep> steps;
  std::vector<std::string> left_out;  // "T'^2: …why and what to do"
  // If powers beyond a stated order are significant: the fit with these powers.
  std::optional<SweepFit> higher;
  double moved_sigmas = 0.0;  // largest shift of a term by `higher` in σ; σ of `fit` allow for it
};

// `wanted`: orders, rates and lags, some of them open (ThermalOptions). Terms that the recording
// cannot determine are left out and named:
//
//   a rate term   if less than a quarter of its RMS is independent of any function of temperature
//                 and of the other rate terms: one rate only, or heating only
//   a lag         if heating and cooling do not determine a rate term, or if the best lag exceeds
//                 a quarter of the recording, which is drift
//
// An open order becomes the lowest for which no higher order is both significant (p < 1 %, divided
// among all that are tried) and better for held-out blocks. Open rate terms enter and leave by the
// same two criteria. An open number of lags becomes the smallest for which more lags do not lower
// the held-out error by 5 %.
//
// A stated order stays. If higher powers lower the held-out error, and chance would cause this in
// fewer than one axis of 10,000, the fit with them is `higher`.
SweepChoice ChooseSweep(SweepProblem* problem, int axis, const ThermalOptions& wanted);

// The names of the terms: "tau, tau^2, T'".
std::string TermsText(const ThermalOptions& terms);

}  // namespace truetriad
