// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace truetriad::line {

/// Seconds since 1970 of "2026-01-31T12:00:00Z" (fractions of a second allowed), or of the
/// beginning of a day, "2026-01-31"; NaN of another text.
double SecondsOf(const std::string& moment);

}  // namespace truetriad::line
