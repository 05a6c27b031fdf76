// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

/// What Calibrate did. The calibration's outcome says whether it can be used.
struct CalibrationSummary {
  Calibration calibration;  ///< Its outcome is kNotCalled until Calibrate has filled it in.
  int iterations = 0;       ///< Iterations of the optimiser, all rounds together.
  int rounds = 0;           ///< How many times weights and excess noise were estimated.
  double initial_cost = -1.0;
  double final_cost = -1.0;
  CalibrateOptions options;  ///< The given options, with every `auto` replaced by what was chosen.
};

}  // namespace truetriad
