// SPDX-License-Identifier: Apache-2.0
#include "data/rows_in_time.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "math/distributions.h"

namespace truetriad {
namespace {

// Two readings count as one attitude if they differ by less than this share of their length: 1
// degree, or 2 for the noisier magnetometer. One in ten thousand random attitudes is as close to
// the one before. The field is compared, too: in a table of headings, 5 degrees apart, only the
// field changes.
constexpr double kLikeForce = 0.0175, kLikeField = 0.035;

// 5.7 deg/s: at rest no gyroscope differs more than a few deg/s from its bias.
constexpr double kTurningRadps = 0.1;
constexpr double kMostTurning = 0.05;  // Chosen: share of rows; accidents disturb fewer.

constexpr const char* kRemedy =
    "Add a column `time[s]`, or state the sampling rate in a manifest (`time: {unit: samples, "
    "rate_hz: 100}`); if each row is a rest nevertheless, state `poses: every_row` in an "
    "experiment (`-c`)";

// Whether any row has a covariance, a name, a face or an attitude.
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
  std::vector<Eigen::Vector3d> rates_radps;
  for (const StaticPose& pose : poses.poses) {
    const auto& reading = pose.triads[Triad::kGyroscope];
    if (reading) rates_radps.push_back(gyroscope->unit.truth_per_raw * reading->mean_raw);
  }
  const std::size_t rows = rates_radps.size();
  if (rows == 0) return {};
  Eigen::Vector3d bias_radps;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Eigen::Vector3d& rate : rates_radps) along.push_back(rate[axis]);
    bias_radps[axis] = Median(std::move(along));
  }
  const auto turning =
      std::count_if(rates_radps.begin(), rates_radps.end(), [&](const Eigen::Vector3d& rate) {
        return (rate - bias_radps).norm() > kTurningRadps;
      });
  if (static_cast<double>(turning) <= kMostTurning * static_cast<double>(rows)) return {};
  return Error(ErrorCode::kMissingTime,
               {poses.source},
               "has no time column, so each of its " + std::to_string(rows) +
                   " rows would be a rest; but the gyroscope shows rotation in " +
                   std::to_string(turning) + " of them. " + kRemedy);
}

// True also if one of the poses has no reading.
bool AreAlike(const StaticPose& pose, const StaticPose& other, Triad triad, double share) {
  const auto& reading = pose.triads[triad];
  const auto& before = other.triads[triad];
  return !reading || !before ||
         (reading->mean_raw - before->mean_raw).norm() <= share * reading->mean_raw.norm();
}

}  // namespace

Status RejectRowsOfALog(const PoseSet& poses) {
  if (poses.has_time || AreNamed(poses)) return {};
  TRUETRIAD_RETURN_IF_ERROR(RejectTurningRows(poses));
  if (poses.poses.size() <= kMostRowsAsRests) return {};
  std::int64_t rows = 0, alike = 0;
  const StaticPose* before = nullptr;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.triads[Triad::kAccelerometer]) continue;
    ++rows;
    if (before != nullptr && AreAlike(pose, *before, Triad::kAccelerometer, kLikeForce) &&
        AreAlike(pose, *before, Triad::kMagnetometer, kLikeField)) {
      ++alike;
    }
    before = &pose;
  }
  if (2 * alike <= rows) return {};
  return Error(ErrorCode::kMissingTime,
               {poses.source},
               "has no time column, so each of its " + std::to_string(rows) +
                   " rows would be a rest; but " + std::to_string(alike) +
                   " of them show the attitude of the row before, as in a log that was recorded "
                   "through time. " +
                   kRemedy);
}

}  // namespace truetriad
