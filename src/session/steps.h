// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "truetriad/base/result.h"
#include "truetriad/config/experiment.h"
#include "truetriad/session/session.h"

namespace truetriad {

/// The poses of `experiment.inputs`, each a session of one unit: those of a later session follow
/// those of earlier ones in number and time, and no turn connects them. `first`: a recording that
/// was read already; if the experiment asks for it, it is used and left empty. Error (bad input):
/// as LoadPoses; sessions of different units, or in different units of measurement. Error (usage):
/// keys that apply to one recording only.
Result<LoadedPoses> LoadSessions(const Experiment& experiment,
                                 std::optional<LoadedPoses>* first,
                                 const ProgressCallback& progress,
                                 const RecordingOpener& opener);

/// Fills in what the experiment takes from files and from the recording: attitudes and forces of
/// the poses, unless the poses are yet to be taken (LoadedPoses::input is empty), fixed matrices,
/// noise from an Allan deviation, the start of a sweep. Error (bad input): files that contradict
/// the experiment or the recording, which may be of another unit. With too little data only the
/// serial number is checked.
Status SettleWithRecording(LoadedPoses* loaded, Experiment* experiment);

}  // namespace truetriad
