// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Error (not enough) when a triad has fewer poses than its wanted model has parameters.
Status CheckPoseCounts(const PoseSet& poses, const CalibrateOptions& options);

// What readings that lie in one plane, or in one part of their ellipsoid, leave open: for the case
// that there is no start to analyse. Empty when they are spread out.
std::vector<WeakDirection> WeakDirectionsOfReadings(const PoseSet& poses,
                                                    const CalibrateOptions& options);

// All distinct starts worth trying, best first: one, or several when the magnetometer's rotation
// has rival solutions.
// Error: too few poses for the wanted model, poses that do not determine it (not enough); readings
// that cannot be in the stated unit (bad input).
Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options);

}  // namespace truetriad
