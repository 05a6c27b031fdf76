// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/fleet_run.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "truetriad/base/result.h"

// Flags that the verbs of `fleet` share.
DECLARE_string(store);
DECLARE_string(serial);
DECLARE_string(where);
DECLARE_bool(csv);

namespace truetriad {

/// What `fleet run` starts itself as, once a process; not for people.
inline constexpr std::string_view kFleetWorker = "fleet-worker";
/// What --fail-on of the verbs that calibrate takes.
inline constexpr char kFailOnUnit[] = "unit";
/// What --progress takes.
inline constexpr char kProgressLines[] = "jsonl";

/// How their flags say that units are to be calibrated; makes the output folder, `fleet` unless
/// stated, and that of the units in it. Error (usage, bad input): a flag or the experiment.
Result<fleet::FleetOptions> StatedFleetOptions();

/// Makes the folder of the units' folders, with what their reports share.
Status PrepareUnitsFolder(const fleet::WorkPlan& plan);

/// The value of --store, or the one in the output folder.
std::string StatedStore();
/// Opens it and states the retest policy there, where flags give one. Errors as OpenStore.
Result<std::unique_ptr<fleet::Store>> OpenStatedStore();

/// Notes in the plan which store it is: whichever name it is called by, and no other that is called
/// the same.
Status NameStore(fleet::Store& store, fleet::WorkPlan* plan);

/// "8h", "30m", "1d", "90s" in seconds. Error (usage) names the flag.
Result<double> ParseDuration(const std::string& flag, const std::string& text);

/// Asks the store whether --require-golden lets units be calibrated; empty without that flag.
/// Error (usage): the flag, or no station is named and `needs_station`: not each unit says its own.
using GoldenHold = std::function<Result<std::optional<std::string>>(const std::string& station)>;
Result<GoldenHold> StatedGoldenHold(const fleet::WorkPlan& plan,
                                    fleet::Store& store,
                                    bool needs_station);

/// The flags of a verb that calibrates units: `own` ones, and those that all have.
std::vector<CommandFlag> FleetFlags(std::vector<CommandFlag> own);

}  // namespace truetriad
