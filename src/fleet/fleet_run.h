// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "fleet/fleet_engine.h"
#include "fleet/store.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Calibrates `units`, each in one of `jobs` processes, and adds every run to `store` once its
/// files are on the disk. Where `is_stopped` says so no further unit is begun. Error (bad input):
/// the store or the workers fail; what is done is in the store.
Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
