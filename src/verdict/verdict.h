// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "problem/start_values.h"
#include "start/start.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"
#include "verdict/checks/check.h"

namespace truetriad {

// Includes significant faults in the settled graph, then completes `calibration`: quality, verdict,
// and if the result is usable, the sensors with their covariance. Error (usage): a limit that
// cannot be judged.
Status StateVerdict(const SettledRun& settled, Calibration* calibration);

// States the start values as a calibration without uncertainty. `graph`: laid out at these values.
void StateStart(const PoseSet& poses,
                const CalibrateOptions& options,
                const NoiseState& noise,
                const StartValues& start,
                const PoseGraph& graph,
                Calibration* calibration);

}  // namespace truetriad
