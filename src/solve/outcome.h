// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

// How an optimisation ended.
struct SolveOutcome {
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

// An optimisation stops when a step lowers the cost by less than this share: the result is then
// within sqrt(tolerance * χ²) σ of the optimum.
inline constexpr double kFinalTolerance = 1e-13;
inline constexpr double kRoundTolerance = 1e-8;  // used between noise estimates; 1e-3 σ at χ² = 100

}  // namespace truetriad
