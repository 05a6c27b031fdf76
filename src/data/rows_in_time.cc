// SPDX-License-Identifier: Apache-2.0
#include "data/rows_in_time.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "math/distributions.h"

namespace truetriad {
namespace {

// Fewer rows can be rests that somebody took one after the other; a log at 10 Hz has more after two
// minutes.
constexpr std::size_t kMostRowsInAnyOrder = 1000;
// Readings this close, as a share of their length, are of one attitude: 1 degree. Of attitudes in
// any order one in ten thousand is that close to the one before.
constexpr double kLike = 0.0175;

// At rest no gyroscope reads more than a few degrees a second off its bias.
constexpr double kTurningRadps = 0.1;
constexpr double kMostTurning = 0.05;  // Of the rows: more than were disturbed.

const std::string kRemedy =
    "Add `time[s]`, or state its rate in a manifest (`time: {unit: samples, rate_hz: 100}`); if "
    "each "
    "row is a rest all the same, state `poses: every_row` in an experiment (`-c`)";

// Whether somebody averaged the rows, or gave each a name, a face or an attitude.
bool AreNamed(const PoseSet& poses) {
  return std::any_of(poses.poses.begin(), poses.poses.end(), [](const StaticPose& pose) {
    const auto& reading = pose.triads[Triad::kAccelerometer];
    return !pose.id.empty() || !pose.face_up.empty() || pose.attitude ||
           (reading && reading->has_covariance);
  });
}

Status RejectTurningRows(const PoseSet& poses) {
  const StreamSummary* const gyroscope = poses.Find(Triad::kGyroscope);
  if (gyroscope == nullptr || gyroscope->unit.is_counts) return {};
  std::array<std::vector<double>, 3> rates;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[Triad::kGyroscope]) continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      rates[static_cast<std::size_t>(axis)].push_back(
          gyroscope->unit.truth_per_raw * pose.triads[Triad::kGyroscope]->mean_raw[axis]);
    }
  }
  std::int64_t turning = 0;
  std::array<double, 3> bias{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!rates[axis].empty()) bias[axis] = Median(rates[axis]);
  }
  for (std::size_t i = 0; i < rates[0].size(); ++i) {
    double square = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) square += std::pow(rates[axis][i] - bias[axis], 2);
    turning += square > kTurningRadps * kTurningRadps ? 1 : 0;
  }
  const auto rows = static_cast<std::int64_t>(rates[0].size());
  if (static_cast<double>(turning) <= kMostTurning * static_cast<double>(rows)) return {};
  return Error(ErrorCode::kMissingTime,
               {poses.source},
               "has no time column, so each of its " + std::to_string(rows) +
                   " rows would be a rest; but the gyroscope turns in " + std::to_string(turning) +
                   " of them. " + kRemedy);
}

}  // namespace

Status RejectRowsOfALog(const PoseSet& poses) {
  if (poses.has_time || AreNamed(poses)) return {};
  TRUETRIAD_RETURN_IF_ERROR(RejectTurningRows(poses));
  if (poses.poses.size() <= kMostRowsInAnyOrder) return {};
  std::int64_t rows = 0, alike = 0;
  const TriadPose* before = nullptr;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[Triad::kAccelerometer]) continue;
    const TriadPose& reading = *pose.triads[Triad::kAccelerometer];
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
                   "through time. " +
                   kRemedy);
}

}  // namespace truetriad
