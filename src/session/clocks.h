// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// By how much a sensor's times are later than those of the reference (ClockReference), beyond what
/// has been taken off them.
struct ClockLeft {
  double later_s = 0.0;
  double sigma_s = 0.0;
};

/// Those that a recording of rests and its solution show. Of a clock that was `taken_off` as a lag,
/// which is no better known than to tenths of a second, whatever is left.
PerTriad<std::optional<ClockLeft>> ClocksLeft(const PoseSet& poses,
                                              const Calibration& calibration,
                                              const PerTriad<std::optional<ClockLeft>>& taken_off);

/// What was taken off against the clock of `reference`, in the place of what an `earlier` solution
/// without that said of it.
void SayClocksCorrected(const PerTriad<std::optional<ClockLeft>>& taken_off,
                        const Findings& earlier,
                        Triad reference,
                        Calibration* calibration);

}  // namespace truetriad
