// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Nobody rests a unit more often, and a log at 10 Hz has more rows after two minutes.
inline constexpr std::size_t kMostRowsAsRests = 1000;

/// Whether the rows of a table without times may each be a rest of its own.
/// Error (bad input): the gyroscope turns in them, or they follow each other as readings of a log
/// do, most of which are like the one before, since a unit turns slower than it is read. What was
/// averaged, or has a name, a face or an attitude, is a rest.
Status RejectRowsOfALog(const PoseSet& poses);

}  // namespace truetriad
