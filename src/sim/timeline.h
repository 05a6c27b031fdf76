// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/chamber.h"
#include "sim/motion.h"
#include "truetriad/sim/scenario.h"
#include "truetriad/sim/simulation.h"

namespace truetriad {

/// What happens to one unit, without its sensors.
struct Timeline {
  Motion motion;
  Chamber chamber;
  std::vector<TrueRest> rests;
};

/// Of unit `unit` of a valid scenario.
Timeline MakeTimeline(const Scenario& scenario, int unit);

/// Lowest and highest temperature of the sensing elements.
Eigen::Vector2d ElementRange(const Scenario& scenario, const Timeline& timeline);

}  // namespace truetriad
