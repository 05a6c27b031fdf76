// SPDX-License-Identifier: Apache-2.0
#include "data/recorded_temperature.h"

#include <algorithm>
#include <limits>

namespace truetriad {

std::optional<Eigen::Vector3d> RecordedDegc(const PoseSet& poses) {
  if (poses.poses.empty()) return std::nullopt;
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0.0;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.temperature_degc) return std::nullopt;
    low = std::min(low, *pose.temperature_degc);
    high = std::max(high, *pose.temperature_degc);
    sum += *pose.temperature_degc;
  }
  // A sum of equal values is rounded.
  const double mean = sum / static_cast<double>(poses.poses.size());
  return Eigen::Vector3d(low, std::clamp(mean, low, high), high);
}

}  // namespace truetriad
