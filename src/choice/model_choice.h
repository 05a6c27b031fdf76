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

// Settles what `options` leave to be chosen, and calibrates with it.
//
// Models are nested: the matrix of a triad from bias over diagonal and symmetric to full (for the
// leading triad in a free frame symmetric is full in another gauge), a matrix in temperature from
// one share for all gains over a gain an axis to full, polynomials in temperature from order 0 to
// what the number of `temperatures` that the poses were taken at can speak for, and each higher
// term and rate term is there or not. The largest model that the poses determine is calibrated
// first; its weights and its noise are then those of every candidate, so that they differ in
// nothing but their terms. From there terms are taken away, the least significant first. One stays
// if the likelihood ratio leaves no doubt of it (0.1 %, not of what follows temperature), else only
// if all three say so:
//
//   likelihood ratio   what it lowers -2 log L by cannot be chance: F after Kenward and Roger 1997
//                      where the noise was estimated, else χ², at 1 %; of how a bias follows
//                      temperature F against what the temperatures have beyond the terms
//   BIC                -2 log L + k ln n is lower with it, n rows of poses and turns
//   held-out error     held-out poses and turns are predicted better with it; where something in
//                      temperature is open those of one temperature after the other: what drifts
//                      between them looks like a term to the poses
//
// What was taken away may come back when the same three say so without it. At most some dozens of
// solutions, each of a graph that starts at the larger model's optimum; the same poses give the
// same choice.
//
// The summary holds the alternatives, its options what was chosen. Where no model is determined it
// is that of the smallest one that was tried; where the poses leave too few degrees of freedom to
// weigh anything, that of the largest matrices they determine, and it says so.
Result<CalibrationSummary> CalibrateWithChoice(const CalibrateOptions& options,
                                               int temperatures,
                                               const CalibrateOnce& calibrate);

}  // namespace truetriad
