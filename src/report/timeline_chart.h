// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/content.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/quality.h"

namespace truetriad {

/// A recording over time: readings of each sensor with rests shaded, those with rejected readings
/// crossed, what was left out, and the temperature of the rests. Nothing without times.
/// `leads_to_rows`: the page has a row for each pose.
Drawing TimelineDrawing(const PoseSet& poses,
                        const std::vector<RejectedPose>& rejected,
                        bool leads_to_rows);

}  // namespace truetriad
