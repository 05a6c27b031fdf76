// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/session/session.h"

namespace truetriad {

/// The poses of `experiment.inputs`, each of which is a session of one device. Poses of a later
/// session follow those of earlier sessions in number and time; no turn connects two sessions.
/// `first`: a recording that was read already; if the experiment asks for it, it is used, and
/// `first` becomes empty. Error (bad input): as LoadPoses; sessions are of different devices or in
/// different units. Error (usage): keys that apply to one recording only.
Result<LoadedPoses> LoadSessions(const Experiment& experiment,
                                 std::optional<LoadedPoses>* first,
                                 const ProgressCallback& progress,
                                 const RecordingOpener& opener);

/// Fills in what the experiment takes from files and from the recording: fixed matrices, noise from
/// an Allan deviation, the start of a sweep, and, unless the poses are yet to be taken
/// (LoadedPoses::input is empty), attitudes and forces of the poses. Error (bad input): files
/// contradict the experiment or the recording, or the recording is of another device. If the
/// recording has too few data to be calibrated, only the serial number is checked.
Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment);

}  // namespace truetriad
