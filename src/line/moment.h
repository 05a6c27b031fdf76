// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace truetriad::line {

/// Seconds since 1970 of "2026-01-31T12:00:00Z", or of a day alone; NaN of anything else. Digits
/// beyond the seconds count, too.
double SecondsOf(const std::string& moment);

}  // namespace truetriad::line
