// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/session/session.h"

namespace truetriad {

/// The poses of `experiment.inputs`, each a session of one unit: those of the second follow those
/// of the first, in number and time, and no turn leads from one to the other.
/// Error (bad input): as LoadPoses; sessions of different units, or in different units of
/// measurement. Error (usage): what the experiment says of one recording alone. `first`, where it
/// is what the experiment asks for, is taken for the first of them and left empty.
Result<LoadedPoses> LoadSessions(const Experiment& experiment,
                                 std::optional<LoadedPoses>* first,
                                 const ProgressCallback& progress,
                                 const RecordingOpener& opener);

/// Fills in what the experiment leaves to files and to the recording: attitudes and forces of the
/// poses, unless these are yet to be taken (LoadedPoses::input is empty), matrices that are held,
/// noise from an Allan deviation, what a sweep starts from.
/// Error (bad input): files that contradict the experiment or the recording, which may be of
/// another unit. Only that is looked at where there is not enough to calibrate from.
Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment);

}  // namespace truetriad
