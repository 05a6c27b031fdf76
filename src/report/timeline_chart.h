// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/data/static_pose.h"
#include "truetriad/model/quality.h"

namespace truetriad {

/// A recording over time as inline SVG: rests shaded, those with rejected readings marked by their
/// numbers, what was left out, and the temperature of the rests. The empty string without times.
std::string TimelineChart(const PoseSet& poses, const std::vector<RejectedPose>& rejected);

}  // namespace truetriad
