// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <gflags/gflags.h>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"

// Flags that verbs which export or import share.
DECLARE_string(instance);
DECLARE_string(units);

namespace truetriad {

/// "12" or "0.5". Error (usage) names the flag.
Result<std::int64_t> ParseInteger(const std::string& flag, const std::string& text);
Result<double> ParseReal(const std::string& flag, const std::string& text);

/// The value of --instance.
Result<std::optional<int>> ParseInstance();

/// Whether --outside-limits allows exports of units that may not leave.
Result<bool> AllowsOutsideLimits();

/// The value of --units: each unit goes to the sensor that it is a unit of, `counts` to all.
Result<PerTriad<std::optional<std::string>>> ParseUnits();

}  // namespace truetriad
