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

/// Averages the readings over the rows or times of stated rates, as GivenPoses does for rests.
class RateMeans {
 public:
  /// `monitor`: of the leading stream, belongs to the caller.
  RateMeans(const std::vector<StatedRate>& rates,
            const RecordingInfo& info,
            Triad leading,
            const StreamMonitor& monitor);

  Status Validate() const;
  Status Add(const std::vector<SampleBlock>& blocks);

  /// Removes the poses in which a rate was held from `set`, and fills in set->rates. The poses have
  /// their numbers and covariances; the covariances of the remaining ones are computed again.
  /// `moments[i]` belongs to set->poses[i]. Error: a rate without readings, that was not held, or
  /// with the number of a missing pose.
  Status Finish(const PerTriad<Eigen::Vector3d>& resolution_raw,
                std::vector<PerTriad<TriadPoseMoments>>* moments,
                PoseSet* set);

 private:
  std::vector<StatedRate> rates_;
  std::vector<std::size_t> stretches_;  // Rates that are not at a pose, in file order.
  std::optional<GivenPoses> means_;
};

/// Places whose readings are kept: turns, then rates, without those at poses.
std::vector<MotionPlace> SpansToKeep(const PoseSelection& selection);

/// Fills in set->turns from `recorder`, and sets the fault of moves in which a rate was held and of
/// turns that are cut. Error: a turn outside of the log, or at a pose without a next one.
Status FinishTurns(const PoseSelection& selection, const MoveRecorder& recorder, PoseSet* set);

/// Sets the fault of known turns whose rows or times begin or end while the unit still turns, so
/// that a part of their angle is outside, and names them in set->findings. Needs set->poses.
void RejectCutTurns(PoseSet* set);

}  // namespace truetriad
