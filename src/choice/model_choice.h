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

// Calibrates with options that leave nothing open. Unless it is null, `settled` receives the model.
using CalibrateOnce =
    std::function<Result<CalibrationSummary>(const CalibrateOptions&, SettledModel* settled)>;

// Chooses the parts of the model that `options` leave open, and calibrates with them.
//
// Models are nested. The matrix of a triad is bias, diagonal, symmetric or full; for the leading
// triad in a free frame, symmetric is full in another gauge. A matrix in temperature has one factor
// for all gains, one for each axis, or is full. A polynomial in temperature has an order from 0 to
// the highest that poses at this number of `temperatures` can test. Each higher term and rate term
// is present or not. The largest model that the poses determine is calibrated first. All candidates
// have its weights and noise, so that they differ only in their terms. Terms are then removed, the
// least significant first. A term that does not depend on temperature stays if its likelihood ratio
// is significant at 0.1 %. Any other term stays only if it meets all three criteria:
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
// The summary lists the alternatives; its options are those of the chosen model. If the poses
// determine no model, the summary is that of the smallest model tried. If they leave too few
// degrees of freedom for a test, it is that of the largest matrices that they determine, with a
// finding.
Result<CalibrationSummary> CalibrateWithChoice(const CalibrateOptions& options,
                                               int temperatures,
                                               const CalibrateOnce& calibrate);

}  // namespace truetriad
