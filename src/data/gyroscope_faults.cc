// SPDX-License-Identifier: Apache-2.0
#include "data/gyroscope_faults.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace truetriad {
namespace {

// The runs of at least `fewest` readings that repeat the first of them on `axis`, or where it is
// not given on all axes at once.
std::vector<EqualReadings> RunsOfEquals(const std::vector<Eigen::Vector3d>& readings,
                                        std::optional<Eigen::Index> axis,
                                        std::size_t fewest) {
  std::vector<EqualReadings> runs;
  const auto are_equal = [&](std::size_t i, std::size_t k) {
    return axis ? readings[i][*axis] == readings[k][*axis] : readings[i] == readings[k];
  };
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= readings.size(); ++i) {
    if (i < readings.size() && are_equal(i, begin)) continue;
    if (i - begin >= fewest) runs.push_back({begin, i});
    begin = i;
  }
  return runs;
}

}  // namespace

std::vector<EqualReadings> RunsAtLimit(double limit,
                                       double step,
                                       Eigen::Index axis,
                                       const std::vector<Eigen::Vector3d>& readings) {
  const auto is_far = [&](std::size_t i) {
    return i >= readings.size() || std::abs(readings[i][axis] - limit) > kFarSteps * step;
  };
  std::vector<EqualReadings> runs = RunsOfEquals(readings, axis, kSaturatedReadings);
  std::erase_if(runs, [&](const EqualReadings& run) {
    // Before the first reading is far, too: 0 - 1 is beyond the last.
    return readings[run.begin][axis] != limit || !(is_far(run.end) || is_far(run.begin - 1));
  });
  return runs;
}

std::vector<EqualReadings> StuckRuns(const std::vector<Eigen::Vector3d>& readings,
                                     const Eigen::Vector3d& step_raw,
                                     double repeats) {
  const auto fewest = static_cast<std::size_t>(std::ceil(kStuckReadings * repeats));
  std::vector<EqualReadings> runs = RunsOfEquals(readings, std::nullopt, fewest);
  const auto is_far = [&](std::size_t i, std::size_t from) {
    if (i >= readings.size()) return false;
    const Eigen::Array3d change = (readings[i] - readings[from]).cwiseAbs();
    return (change > kFarSteps * step_raw.array()).any();
  };
  std::erase_if(runs, [&](const EqualReadings& run) {
    const bool is_all = run.end - run.begin == readings.size();
    // Before the first reading there is none: 0 - 1 is beyond the last.
    return !is_all && !is_far(run.begin - 1, run.begin) && !is_far(run.end, run.begin);
  });
  return runs;
}

}  // namespace truetriad
