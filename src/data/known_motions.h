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

/// Averages the readings over the rows or times of stated rates, as those of a rest are.
class RateMeans {
 public:
  /// `monitor`: of the leading stream, belongs to the caller.
  RateMeans(const std::vector<StatedRate>& rates,
            const RecordingInfo& info,
            Triad leading,
            const StreamMonitor& monitor);

  Status Validate() const;
  Status Add(const std::vector<SampleBlock>& blocks);

  /// Takes the poses out of `set` that are no rests because a rate was held in them, and fills in
  /// set->rates. The poses have their numbers and covariances; those of what remains are filled in
  /// again. `moments[i]` belongs to set->poses[i]. Error: a rate without readings, or with the
  /// number of a pose that is not there.
  Status Finish(const PerTriad<Eigen::Vector3d>& resolution_raw,
                std::vector<PerTriad<TriadPoseMoments>>* moments,
                PoseSet* set);

 private:
  std::vector<StatedRate> rates_;
  std::vector<std::size_t> stretches_;  // Those that are no pose, in the order of the file.
  std::optional<GivenPoses> means_;
};

/// Where readings must not be dropped: in turns, then in rates; those that are no pose.
std::vector<MotionPlace> SpansToKeep(const PoseSelection& selection);

/// Fills in set->turns from what was recorded, and says of moves in which a rate was held that they
/// are not to be used, nor turns that are cut. Error: the number of a pose without a move into the
/// next.
Status FinishTurns(const PoseSelection& selection, const MoveRecorder& recorder, PoseSet* set);

/// Sets the fault of known turns whose rows or times begin or end while the unit still turns, so
/// that a part of their angle is outside, and names them in set->findings. Needs set->poses.
void RejectCutTurns(PoseSet* set);

}  // namespace truetriad
