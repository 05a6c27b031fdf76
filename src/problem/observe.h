// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/pose_node.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The mean reading of a triad in `pose` with its covariance: the stated one, that of an Allan
// deviation, or that inside the rest. For NoiseSource::kResidual the covariance is that of rounding
// alone. Error (bad input): an Allan deviation states the noise, but the averaging time is unknown.
Result<Observation> Observe(const PoseSet& poses,
                            const StaticPose& pose,
                            Triad triad,
                            const TriadOptions& sensor,
                            NoiseSource source);

// The middle of a pose's readings, s; without times the pose's number.
double TimeOf(const PoseSet& poses, const StaticPose& pose);

// σ of one gyroscope reading during a turn, raw unit: the noise inside the rests, and rounding;
// above zero, so that weights are finite.
Eigen::Vector3d ReadingSigma(const PoseSet& poses, const Eigen::Matrix3d& sensitivity);

}  // namespace truetriad
