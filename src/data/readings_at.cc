// SPDX-License-Identifier: Apache-2.0
#include "data/readings_at.h"

#include <algorithm>
#include <cstddef>

namespace truetriad {

std::vector<Eigen::Vector3d> ReadingsAt(const std::vector<std::int64_t>& at_ns,
                                        const std::vector<std::int64_t>& time_ns,
                                        const std::vector<Eigen::Vector3d>& reading_raw) {
  std::vector<Eigen::Vector3d> readings;
  if (time_ns.empty() || at_ns.empty()) return readings;
  readings.reserve(at_ns.size());
  auto next = std::lower_bound(time_ns.begin(), time_ns.end(), at_ns.front());
  for (const std::int64_t each_ns : at_ns) {
    while (next != time_ns.end() && *next < each_ns) ++next;
    const auto right =
        static_cast<std::size_t>(std::min(next, time_ns.end() - 1) - time_ns.begin());
    const std::size_t left = right > 0 && time_ns[right] > each_ns ? right - 1 : right;
    const double span = static_cast<double>(time_ns[right] - time_ns[left]);
    const double share =
        span > 0.0 ? std::clamp(static_cast<double>(each_ns - time_ns[left]) / span, 0.0, 1.0)
                   : 0.0;
    readings.emplace_back((1.0 - share) * reading_raw[left] + share * reading_raw[right]);
  }
  return readings;
}

}  // namespace truetriad
