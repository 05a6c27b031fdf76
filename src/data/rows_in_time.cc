// SPDX-License-Identifier: Apache-2.0
#include "data/rows_in_time.h"

#include <cstdint>
#include <string>

#include <Eigen/Core>

namespace truetriad {
namespace {

// Fewer rows can be rests that somebody took one after the other; a log at 10 Hz has more after two
// minutes.
constexpr std::size_t kMostRowsInAnyOrder = 1000;
// Readings this close, as a share of their length, are of one attitude: 1 degree. Of attitudes in any
// order one in ten thousand is that close to the one before.
constexpr double kLike = 0.0175;

}  // namespace

Status RejectRowsOfALog(const PoseSet& poses) {
  if (poses.has_time || poses.poses.size() <= kMostRowsInAnyOrder) return {};
  std::int64_t rows = 0, alike = 0;
  const TriadPose* before = nullptr;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[Triad::kAccelerometer]) continue;
    const TriadPose& reading = *pose.triads[Triad::kAccelerometer];
    if (reading.has_covariance) return {};  // Somebody averaged it.
    ++rows;
    if (before != nullptr &&
        (reading.mean_raw - before->mean_raw).norm() <= kLike * reading.mean_raw.norm()) {
      ++alike;
    }
    before = &reading;
  }
  if (2 * alike <= rows) return {};
  return Error(ErrorCode::kMissingTime,
               {poses.source},
               "has no time column, so each of its " + std::to_string(rows) +
                   " rows would be a rest; but " + std::to_string(alike) +
                   " of them are within 1 degree of the row before, as in a log that was recorded "
                   "through time. Add `time[s]`, or state its rate in a manifest (`time: {unit: "
                   "samples, rate_hz: 100}`); if each row is a rest all the same, state `poses: "
                   "every_row` in an experiment (`-c`)");
}

}  // namespace truetriad
