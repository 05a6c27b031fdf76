// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The refusal of a sensor without start values, with the reason that its readings show: a constant
// axis, two equal axes, or readings in a plane.
Error WhyNoStart(const PoseSet& poses, Triad triad, const Error& error);

// The refusal of a gyroscope without start values. If at least half of the turns have a fault, the
// first fault is the reason.
Error WhyNoGyroscope(const PoseSet& poses, const Error& error);

// The directions that readings in one plane, or in one part of their ellipsoid, leave undetermined.
// It is used if there are no start values to analyse. Empty if the readings are spread out.
std::vector<WeakDirection> WeakDirectionsOfReadings(const PoseSet& poses,
                                                    const CalibrateOptions& options);

}  // namespace truetriad
