// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

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

/// The station that a plan's experiment or tags name. Error (usage): none.
Result<std::string> StationOf(const WorkPlan& plan);

}  // namespace truetriad::fleet
