// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace truetriad::line {

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// Where a number lies with the stated confidence, half of the doubt on either side; NaN where
/// nothing can be said, infinite where a side is open.
struct Interval {
  double lower = kNotKnown, upper = kNotKnown;
};

/// A number that was estimated.
struct Estimate {
  double value = kNotKnown;
  Interval interval;
};

}  // namespace truetriad::line
