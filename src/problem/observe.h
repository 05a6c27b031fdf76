// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/pose_node.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Mean reading of a triad in `pose` with its covariance: the stated covariance, that from an Allan
// deviation, or that within the rest. For NoiseSource::kResidual the covariance is that of rounding
// alone. Error (bad input): an Allan deviation states the noise, but the averaging time is unknown.
Result<Observation> Observe(const PoseSet& poses,
                            const StaticPose& pose,
                            Triad triad,
                            const TriadOptions& sensor,
                            NoiseSource source);

// The time of the middle of a pose's readings, s. If the recording has no times: the pose's number.
double TimeOf(const PoseSet& poses, const StaticPose& pose);

// σ of one gyroscope reading during a turn, raw unit, from the noise within the rests and from
// rounding. It is above zero, so that weights are finite.
Eigen::Vector3d ReadingSigma(const PoseSet& poses, const Eigen::Matrix3d& sensitivity);

}  // namespace truetriad
