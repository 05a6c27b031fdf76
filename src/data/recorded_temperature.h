// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "truetriad/data/static_pose.h"

namespace truetriad {

// What the thermometer said at the poses: lowest, mean, highest; nothing where it did not say it at
// each of them.
std::optional<Eigen::Vector3d> RecordedDegc(const PoseSet& poses);

}  // namespace truetriad
