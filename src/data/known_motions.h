// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "data/given_poses.h"
#include "data/move_recorder.h"
#include "data/pose_statistics.h"
#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Averages the readings during stated rates, over rows or times, as GivenPoses does for rests.
class RateMeans {
 public:
  /// `monitor` is that of the leading stream and belongs to the caller.
  RateMeans(const std::vector<StatedRate>& rates,
            const RecordingInfo& info,
            Triad leading,
            const StreamMonitor& monitor);

  Status Validate() const;
  Status Add(const std::vector<SampleBlock>& blocks);

  /// Removes the poses in which a rate was held from `set`, and fills in set->rates. The poses must
  /// have numbers and covariances; the covariances of the remaining poses are computed again.
  /// `moments[i]` belongs to set->poses[i]. Error: a rate has no readings, was not held, or is
  /// stated for a pose that does not exist.
  Status Finish(const PerTriad<Eigen::Vector3d>& resolution_raw,
                std::vector<PerTriad<TriadPoseMoments>>* moments,
                PoseSet* set);

 private:
  std::vector<StatedRate> rates_;
  // Indices in rates_ of the rates that are stated by rows or by time, in order of the recording.
  std::vector<std::size_t> stretches_;
  std::optional<GivenPoses> means_;
};

/// The places that are stated by rows or by time, first those of turns, then those of rates. The
/// readings at these places must be kept.
std::vector<MotionPlace> SpansToKeep(const PoseSelection& selection);

/// Fills in set->turns from `recorder`. Sets the fault of moves in which a rate was held, and of
/// turns whose begin or end is cut off. Error: a turn is outside of the log, or has no pose before
/// or after it.
Status FinishTurns(const PoseSelection& selection, const MoveRecorder& recorder, PoseSet* set);

/// If a known turn's rows or times begin or end while the unit still turns, a part of its angle is
/// outside. Sets the fault of such turns, and reports how many there are. Needs set->poses.
void RejectCutTurns(PoseSet* set);

}  // namespace truetriad
