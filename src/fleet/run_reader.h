// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Store::ForEachRun of a store that answers questions: some units at a time, by a few statements
/// that any SQL knows.
Status ReadRuns(Store& store,
                const RunSelection& which,
                const std::function<Status(UnitRun)>& take);

/// Those of `names` that the store has, whole.
Result<std::vector<UnitRun>> ReadNamedRuns(Store& store, const std::vector<std::string>& names);

}  // namespace truetriad::fleet
