// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "noise/variance_components.h"
#include "problem/graph.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Whether accelerometer and magnetometer may stand to each other in another way that explains the
// poses as well: the one angle between gravity and field has several solutions where few poses have
// both sensors, each of which looks determined where it stands. Or that they do not stand to each
// other in any one way. Unset where neither is so, and where turns or given attitudes tell.
std::optional<Finding> FindRivalAlignment(const CalibrateOptions& options,
                                          const ExcessEstimate& noise,
                                          const PoseGraph& solved);

}  // namespace truetriad
