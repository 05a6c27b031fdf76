// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fleet/fleet_engine.h"
#include "fleet/log_watch.h"
#include "fleet/store.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Why no unit may be calibrated at a station: its golden unit has no check in the store, none that
/// is at most `age_s` old, or the last did not agree or is of a time to come. A recording that is
/// checked again does not count. Unset: the last one agreed. Error: of the
/// store.
Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s);

/// Calibrates `units`, each in one of `jobs` processes, and adds every run to `store` once its
/// files are on the disk. Where `is_stopped` says so no further unit is begun. Error (bad input):
/// the store or the workers fail; what is done is in the store.
Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped);

/// As RunFleet, of logs as they arrive in a folder; first those that are there and have no run by
/// this experiment and program. Until `is_stopped`, or the options' idle time. Errors as LogWatch.
Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
