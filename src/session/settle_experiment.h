// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/session/session.h"

namespace truetriad {

/// Error (bad input): the recording is of another unit than the experiment states.
Status CheckSerial(const LoadedPoses& loaded, const Experiment& experiment);

/// Fills in what the experiment leaves to files and to the recording: attitudes and forces of the
/// poses, matrices that are held, noise from an Allan deviation, what a sweep starts from.
/// Error (bad input): files that contradict the experiment or the recording.
Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment);

/// The matrices that are held at a value which only the recording can tell.
Status HoldMatrices(const LoadedPoses& loaded, Experiment* experiment);

/// Noise of each triad from the Allan deviation that the experiment names.
Status SettleAllanNoise(const PoseSet& poses, Experiment* experiment);

}  // namespace truetriad
