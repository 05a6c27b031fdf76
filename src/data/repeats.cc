// SPDX-License-Identifier: Apache-2.0
#include "data/repeats.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/messages.h"
#include "data/gyroscope_faults.h"

namespace truetriad {
namespace {

// Runs that tell a share of a half to a sixth of it.
constexpr std::size_t kFewestRuns = 32;

// Whether most readings that are far from the one before and the one after come more than once.
bool AreHeld(const std::vector<Eigen::Vector3d>& readings, const Eigen::Vector3d& step_raw) {
  std::size_t runs = 0, once = 0, begin = 0;
  bool is_far_before = false;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const Eigen::Array3d change = (readings[i] - readings[i - 1]).cwiseAbs();
    if (change.maxCoeff() == 0.0) continue;
    const bool is_far = (change > kFarSteps * step_raw.array()).any();
    if (is_far && is_far_before) {
      ++runs;
      once += i - begin == 1 ? 1 : 0;
    }
    begin = i;
    is_far_before = is_far;
  }
  return runs >= kFewestRuns && 2 * once < runs;
}

}  // namespace

std::size_t LeaveOutHeld(const Eigen::Vector3d& step_raw, ReadingTrack* track) {
  std::vector<Eigen::Vector3d>& readings = track->reading_raw;
  if (!AreHeld(readings, step_raw)) return 0;
  const std::size_t count = readings.size();
  std::size_t kept = 1;
  for (std::size_t i = 1; i < count; ++i) {
    if (readings[i] == readings[kept - 1]) continue;
    readings[kept] = readings[i];
    track->time_ns[kept] = track->time_ns[i];
    if (!track->row.empty()) track->row[kept] = track->row[i];
    ++kept;
  }
  readings.resize(kept);
  track->time_ns.resize(kept);
  if (!track->row.empty()) track->row.resize(kept);
  return count - kept;
}

void LeaveOutRepeats(PoseSet* set) {
  PerTriad<std::optional<Eigen::Vector3d>> before;
  double repeats = 0.0;
  for (StaticPose& pose : set->poses) {
    for (const Triad triad : kTriads) {
      Boxed<TriadPose>& seen = pose.triads[triad];
      if (!seen) continue;
      if (before[triad] == seen->mean_raw) {
        seen.reset();
        repeats += 1.0;
      } else {
        before[triad] = seen->mean_raw;
      }
    }
  }
  if (repeats == 0.0) return;
  std::erase_if(set->poses, [](const StaticPose& pose) {
    return std::none_of(pose.triads.begin(), pose.triads.end(), [](const auto& seen) {
      return static_cast<bool>(seen);
    });
  });
  set->findings.push_back(
      Finding(FindingCode::kRepeatedRows,
              Counted(static_cast<std::int64_t>(repeats), "reading") +
                  " repeat the row before to the last digit, and count once: the log is faster "
                  "than the sensor, or that is stuck")
          .With("rows", repeats));
}

}  // namespace truetriad
