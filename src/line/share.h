// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "line/interval.h"

namespace truetriad::line {

/// The share `count` of `all`, with the interval of Wilson (1927); NaN of none.
Estimate ShareOf(int count, int all, double confidence = 0.95);

}  // namespace truetriad::line
