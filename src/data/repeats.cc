// SPDX-License-Identifier: Apache-2.0
#include "data/repeats.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/messages.h"
#include "math/common_step.h"

namespace truetriad {

std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track) {
  std::vector<Eigen::Vector3d>& readings = track->reading_raw;
  if (stream.repeats < 2.0) return 0;
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

double StepOfRows(Triad triad, const std::vector<StaticPose>& poses) {
  std::vector<double> distances;
  const StaticPose* last = nullptr;
  for (const StaticPose& pose : poses) {
    if (!pose.triads[triad]) continue;
    if (last != nullptr) {
      const Eigen::Vector3d step = pose.triads[triad]->mean_raw - last->triads[triad]->mean_raw;
      for (const double distance : step.cwiseAbs()) distances.push_back(distance);
    }
    last = &pose;
  }
  return CommonStep(distances);
}

void LeaveOutRepeats(PoseSet* set) {
  PerTriad<std::optional<Eigen::Vector3d>> before;
  double repeats = 0.0, all = 0.0;
  for (StaticPose& pose : set->poses) {
    for (const Triad triad : kTriads) {
      Boxed<TriadPose>& seen = pose.triads[triad];
      if (!seen) continue;
      all += 1.0;
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
  Finding finding(FindingCode::kRepeatedRows,
                  Counted(static_cast<std::int64_t>(repeats), "reading") +
                      " repeat the row before to the last digit, and count once: the log is faster "
                      "than the sensor, or that is stuck");
  // A coarse sensor does so by chance.
  if (2.0 * repeats < all) finding.As(Severity::kNote);
  set->findings.push_back(finding.With("rows", repeats));
}

}  // namespace truetriad
