// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Keeps the gyroscope's readings between the poses, and what the accelerometer read then.
///
/// Readings inside a pose are dropped as soon as the pose is known, so that memory holds the moves
/// and what static detection has not judged yet.
class MoveRecorder {
 public:
  void Add(const SampleBlock& block);

  /// `pose` is the next one that is complete.
  void DropRest(const StaticPose& pose);

  /// The moves between consecutive poses of `set`, in order; those that cannot be integrated say
  /// why. Uses the readings up.
  std::vector<RecordedMove> Finish(const PoseSet& set);

 private:
  struct Stream {
    std::vector<std::int64_t> time_ns;
    std::vector<Eigen::Vector3d> reading_raw;

    void Drop(std::int64_t after_ns, std::int64_t before_ns);
  };

  Stream gyroscope_, accelerometer_;
};

}  // namespace truetriad
