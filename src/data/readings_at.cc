// SPDX-License-Identifier: Apache-2.0
#include "data/readings_at.h"

#include <algorithm>
#include <cstddef>

namespace truetriad {

namespace {

template <typename Time>
std::vector<Eigen::Vector3d> Interpolated(const std::vector<Time>& at,
                                          const std::vector<Time>& time,
                                          const std::vector<Eigen::Vector3d>& reading_raw) {
  std::vector<Eigen::Vector3d> readings;
  if (time.empty() || at.empty()) return readings;
  readings.reserve(at.size());
  auto next = std::lower_bound(time.begin(), time.end(), at.front());
  for (const Time each : at) {
    while (next != time.end() && *next < each) ++next;
    const auto right = static_cast<std::size_t>(std::min(next, time.end() - 1) - time.begin());
    const std::size_t left = right > 0 && time[right] > each ? right - 1 : right;
    const double span = static_cast<double>(time[right] - time[left]);
    const double share =
        span > 0.0 ? std::clamp(static_cast<double>(each - time[left]) / span, 0.0, 1.0) : 0.0;
    readings.emplace_back((1.0 - share) * reading_raw[left] + share * reading_raw[right]);
  }
  return readings;
}

}  // namespace

std::vector<Eigen::Vector3d> ReadingsAt(const std::vector<std::int64_t>& at_ns,
                                        const std::vector<std::int64_t>& time_ns,
                                        const std::vector<Eigen::Vector3d>& reading_raw) {
  return Interpolated(at_ns, time_ns, reading_raw);
}

std::vector<Eigen::Vector3d> ReadingsAt(const std::vector<double>& at_s,
                                        const std::vector<double>& time_s,
                                        const std::vector<Eigen::Vector3d>& reading_raw) {
  return Interpolated(at_s, time_s, reading_raw);
}

Eigen::Vector3d MeanOverTime(const std::vector<std::int64_t>& time_ns,
                             const std::vector<Eigen::Vector3d>& reading_raw) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i < reading_raw.size(); ++i) {
    const double step_s = 1e-9 * static_cast<double>(time_ns[i] - time_ns[i - 1]);
    sum += 0.5 * step_s * (reading_raw[i - 1] + reading_raw[i]);
  }
  return sum / (1e-9 * static_cast<double>(time_ns.back() - time_ns.front()));
}

}  // namespace truetriad
