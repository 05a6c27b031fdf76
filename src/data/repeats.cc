// SPDX-License-Identifier: Apache-2.0
#include "data/repeats.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "base/messages.h"
#include "math/common_step.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// The runs of at least `fewest` readings that are equal on `axis`, or on all axes if it is unset.
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
                                       const std::vector<Eigen::Vector3d>& readings,
                                       double repeats) {
  const auto fewest = static_cast<std::size_t>(std::ceil(kSaturatedReadings * repeats));
  const auto is_far = [&](std::size_t i) {
    return i >= readings.size() || std::abs(readings[i][axis] - limit) > kFarSteps * step;
  };
  std::vector<EqualReadings> runs = RunsOfEquals(readings, axis, fewest);
  std::erase_if(runs, [&](const EqualReadings& run) {
    // Before the first run, begin - 1 wraps to an index beyond the last reading, which counts as
    // far.
    return readings[run.begin][axis] != limit || !(is_far(run.end) || is_far(run.begin - 1));
  });
  return runs;
}

void Append(const SampleBlock& block, ReadingTrack* track) {
  track->time_ns.insert(track->time_ns.end(), block.time_ns.begin(), block.time_ns.end());
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    track->reading_raw.emplace_back(block.x[i], block.y[i], block.z[i]);
  }
}

std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track) {
  if (stream.repeats < 2.0 || !Acts(Mechanism::kRepeats)) return 0;
  const std::vector<EqualReadings> runs = RunsOfEquals(track->reading_raw, std::nullopt, 1);
  const auto keep_firsts = [&runs](auto* values) {
    for (std::size_t i = 0; i < runs.size(); ++i) (*values)[i] = (*values)[runs[i].begin];
    values->resize(runs.size());
  };
  const std::size_t count = track->reading_raw.size();
  keep_firsts(&track->reading_raw);
  keep_firsts(&track->time_ns);
  if (!track->row.empty()) keep_firsts(&track->row);
  return count - runs.size();
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
      if (before[triad] == seen->mean_raw && Acts(Mechanism::kRepeats)) {
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
                      " left out as equal to the row before to the last digit: the log is faster "
                      "than the sensor, or the sensor is stuck");
  // If fewer than half repeat, this is a note only, since a coarse sensor repeats by chance.
  if (2.0 * repeats < all) finding.As(Severity::kNote);
  set->findings.push_back(finding.With("rows", repeats));
}

}  // namespace truetriad
