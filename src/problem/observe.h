// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/pose_node.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The mean of a triad that saw `pose`, with its covariance where `source` says that it is known.
// Error (bad input): an Allan deviation is to tell it, but not how long was averaged.
Result<Observation> Observe(const PoseSet& poses,
                            const StaticPose& pose,
                            Triad triad,
                            const TriadOptions& sensor,
                            NoiseSource source);

// Of the middle of the readings of a pose; without times its number.
double TimeOf(const PoseSet& poses, const StaticPose& pose);

// σ of one reading of the gyroscope, raw, as the rests show it. Readings without noise still need
// weights.
Eigen::Vector3d ReadingSigma(const PoseSet& poses, const Eigen::Matrix3d& sensitivity);

}  // namespace truetriad
