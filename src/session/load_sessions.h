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

}  // namespace truetriad
