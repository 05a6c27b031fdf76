// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Chosen: no session has more rests, and a log at 10 Hz has more rows after two minutes.
inline constexpr std::size_t kMostRowsAsRests = 1000;

/// Checks that each row of a table without times may be a rest. A table with a covariance, a name,
/// a face or an attitude in any row passes. Error (bad input): the gyroscope turns in more than 5 %
/// of the rows, or there are more than kMostRowsAsRests rows and most have the attitude of the row
/// before. This is so in a log, since a unit turns slowly compared with its sampling.
Status RejectRowsOfALog(const PoseSet& poses);

}  // namespace truetriad
