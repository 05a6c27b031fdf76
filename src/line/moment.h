// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace truetriad::line {

/// Seconds since 1970 of an ISO 8601 moment: "2026-01-31" (its beginning), "2026-01-31T12:00",
/// "2026-01-31 12:00:00.5", each with Z or an offset ("+01:00") behind the time, or in UTC; NaN of
/// another text, or of one before 1970.
double SecondsOf(const std::string& moment);

/// "2026-01-31T12:00:00Z".
std::string MomentOf(std::int64_t seconds);

}  // namespace truetriad::line
