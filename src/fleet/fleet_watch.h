// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "fleet/fleet_engine.h"
#include "fleet/log_watch.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// As RunFleet, of logs as they arrive in a folder; first those that are there and have no run by
/// this experiment and program. Until `is_stopped`, or the options' idle time. Errors as LogWatch.
Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
