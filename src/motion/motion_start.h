// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "motion/track.h"
#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Start values of a unit that never rests: those of the vector sensors from short means in place of
// rests, those of the gyroscope from how the direction that the leading sensor measures turned in
// the body. Errors: those of FindStartValues.
Result<std::vector<StartValues>> FindMotionStarts(const PoseSet& poses,
                                                  const CalibrateOptions& options,
                                                  const MotionTrack& track);

// Attitudes of the nodes: integrated from the gyroscope, corrected towards the vector sensors.
std::vector<Eigen::Quaterniond> StartAttitudes(const StartValues& start,
                                               const MotionTrack& track,
                                               const std::vector<Moment>& nodes);

// The attitudes of the nodes of a finer chain, computed from those of a coarser chain of the same
// track.
std::vector<Eigen::Quaterniond> FinerAttitudes(const MotionTrack& track,
                                               const GyroModel& gyroscope,
                                               const std::vector<Moment>& coarse,
                                               const std::vector<Eigen::Quaterniond>& attitudes,
                                               const std::vector<Moment>& fine);

}  // namespace truetriad
