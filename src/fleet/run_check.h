// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// What comes from other stores and files is looked at once, where it comes in. All errors are of
// bad input, and say what was seen.

/// Whether NewRunId may have made it, at some moment that there is.
bool IsRunId(std::string_view name);

/// Error: its name or time is none, or its name is of after 2200; it is good and misses a limit, or
/// outside its limits and misses none; the serial number is empty, longer than 1000 bytes or has a
/// NUL; a number is not finite, or negative where it cannot be; a parameter is there twice, or the
/// covariance is not of as many.
Status CheckRun(const UnitRun& run);

/// Error: the name, time or run is none, or CheckDisposition.
Status CheckStored(const Disposition& disposition);
/// Error: the name or time is none, or no station is named.
Status CheckStored(const StationCheck& check);

}  // namespace truetriad::fleet
