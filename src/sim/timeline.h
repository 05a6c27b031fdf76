// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/chamber.h"
#include "sim/motion.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// A turn or a rate that the operator of a turntable would state.
template <typename Stated>
struct TimelineMotion {
  double start_s = 0.0;
  double end_s = 0.0;
  Stated stated;  ///< Its rows are found later.
};

/// What happens to one unit, apart from its sensors.
struct Timeline {
  Motion motion;
  Chamber chamber;
  std::vector<TrueRest> rests;
  std::vector<TimelineMotion<StatedTurn>> turns;
  std::vector<TimelineMotion<StatedRate>> rates;  ///< Each from the start to the end of its hold.
};

/// The timeline of the unit number `unit` of a valid scenario.
Timeline MakeTimeline(const Scenario& scenario, int unit);

/// Lowest and highest temperature of the sensing elements.
Eigen::Vector2d ElementRange(const Scenario& scenario, const Timeline& timeline);

}  // namespace truetriad
