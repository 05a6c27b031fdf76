// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The refusal of a sensor that gave no start values, with what its readings show of why: an axis
// that is dead, two that are one, a plane.
Error WhyNoStart(const PoseSet& poses, Triad triad, const Error& error);

// That of a gyroscope: turns of which most were left out show no axis for that reason.
Error WhyNoGyroscope(const PoseSet& poses, const Error& error);

// What readings that lie in one plane, or in one part of their ellipsoid, leave open: for the case
// that there is no start to analyse. Empty when they are spread out.
std::vector<WeakDirection> WeakDirectionsOfReadings(const PoseSet& poses,
                                                    const CalibrateOptions& options);

}  // namespace truetriad
