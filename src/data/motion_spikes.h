// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/pose_collection.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// What was done about single readings of a moving unit that lie far from their neighbours.
struct SpikeScreen {
  std::int64_t replaced = 0;
  /// What those that are too small to be told one by one may shift the mean by, where they lie to
  /// one side; zero where chance makes as many.
  Eigen::Vector3d one_sided_raw = Eigen::Vector3d::Zero();
};

/// Puts the line between its neighbours in the place of each spike: a gyroscope without the
/// reading would be integrated along that line. A reading is held against the median of three on
/// each side, by what is usual around it, so that a hard move does not look like spikes.
/// `resolution_raw`: the sensor's smallest step. Readings on both sides of a joint are no
/// neighbours.
SpikeScreen ReplaceSpikes(const Eigen::Vector3d& resolution_raw,
                          const std::vector<RecordingJoint>& joints,
                          ReadingTrack* track);

}  // namespace truetriad
