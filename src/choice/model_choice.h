// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "truetriad/base/result.h"
#include "truetriad/problem/options.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {

// A model with its noise and its solution.
struct SettledModel {
  PoseGraph graph;
  NoiseState noise;
};

// Calibrates with options that leave nothing open; `settled` receives the model unless null.
using CalibrateOnce =
    std::function<Result<CalibrationSummary>(const CalibrateOptions&, SettledModel* settled)>;

// Chooses the parts of the model that `options` leave open, and calibrates with them.
//
// Models are nested: the matrix of a triad from bias over diagonal and symmetric to full (for the
// leading triad in a free frame symmetric is full in another gauge), a matrix in temperature from
// one factor for all gains over one per axis to full, polynomials in temperature from order 0 to
// the highest that poses at this number of `temperatures` can test, and each higher term and rate
// term is present or not. The largest model that the poses determine is calibrated first; every
// candidate has that model's weights and noise, so that candidates differ only in their terms. From
// there terms are removed, the least significant first. A term stays if its likelihood ratio is
// significant at 0.1 % (unless it depends on temperature), else only if it meets all three
// criteria:
//
//   likelihood ratio   it lowers -2 log L by more than chance: F after Kenward and Roger 1997 if
//                      the noise was estimated, else χ², at 1 %; for a bias in temperature F
//                      against the scatter of the temperatures beyond the terms
//   BIC                -2 log L + k ln n is lower with it, n rows of poses and turns
//   held-out error     held-out poses and turns are predicted better with it; if a temperature term
//                      is open, those of one temperature at a time are held out, since a drift
//                      between temperatures looks like a term to the poses
//
// A removed term returns if it meets the same criteria in the reduced model. The choice takes at
// most some dozens of solutions, each of which starts at the larger model's optimum, and is
// reproducible.
//
// The summary holds the alternatives, its options the chosen model. If no model is determined, the
// summary is that of the smallest one that was tried; if the poses leave too few degrees of freedom
// for a test, that of the largest matrices they determine, with a finding about it.
Result<CalibrationSummary> CalibrateWithChoice(const CalibrateOptions& options,
                                               int temperatures,
                                               const CalibrateOnce& calibrate);

}  // namespace truetriad
