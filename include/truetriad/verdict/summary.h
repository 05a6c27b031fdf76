// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

/// What Calibrate did. The calibration's outcome says whether it can be used.
struct CalibrationSummary {
  Calibration calibration;  ///< outcome kNotCalled until Calibrate fills it.
  int iterations = 0;       ///< Iterations of the optimiser, all rounds together.
  int rounds = 0;           ///< Number of times that weights and excess noise were estimated.
  double initial_cost = -1.0;
  double final_cost = -1.0;
  CalibrateOptions options;  ///< As given, with every `auto` replaced by what was chosen.
};

}  // namespace truetriad
