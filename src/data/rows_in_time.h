// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Chosen: no session has more rests, and a log at 10 Hz has more rows after two minutes.
inline constexpr std::size_t kMostRowsAsRests = 1000;

/// Checks that the rows of a table without times may each be a rest of its own.
/// Error (bad input): the gyroscope turns in more than 5 % of the rows, or most of more than
/// kMostRowsAsRests rows have the attitude of the row before, as in a log, since a unit turns
/// slowly against its sampling. With a covariance, a name, a face or an attitude in any row, all
/// are rests.
Status RejectRowsOfALog(const PoseSet& poses);

}  // namespace truetriad
