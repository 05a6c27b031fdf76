// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Why a solution is not to be used though it looks settled; unset where nothing speaks against it:
//
//   the readings contradict the dip that is stated, as they say it with the dip free. Held to a
//   wrong one they scatter over the poses, as if something else had changed.
//
//   accelerometer and magnetometer may stand to each other in another way that explains the poses
//   as well, unless turns or given attitudes tell: the one angle between gravity and field has
//   several solutions where few poses have both sensors, each of which looks determined where it
//   stands. Or they do not stand to each other in any one way.
std::optional<Finding> WhyNotAsSettled(const CalibrateOptions& options,
                                       const NoiseState& noise,
                                       const PoseGraph& solved);

}  // namespace truetriad
