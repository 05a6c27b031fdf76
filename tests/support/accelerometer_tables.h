// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

/// Poses with one reading of an accelerometer each, with the same σ on all axes; σ 0: unknown.
inline PoseSet AccelerometerPoses(const std::vector<Eigen::Vector3d>& readings, double sigma_mps2) {
  PoseSet poses;
  poses.source = "poses.csv";
  StreamSummary stream;
  stream.triad = Triad::kAccelerometer;
  stream.unit = {"m/s^2", 1.0, false};
  poses.streams.push_back(stream);
  for (const Eigen::Vector3d& reading : readings) {
    StaticPose pose;
    pose.number = static_cast<int>(poses.poses.size()) + 1;
    TriadPose seen;
    seen.samples = 1;
    seen.mean_raw = reading;
    seen.mean_covariance_raw = sigma_mps2 * sigma_mps2 * Eigen::Matrix3d::Identity();
    seen.has_covariance = sigma_mps2 > 0.0;
    pose.triads[Triad::kAccelerometer] = seen;
    poses.poses.push_back(pose);
  }
  return poses;
}

/// Options for an accelerometer alone, with gravity known exactly.
inline CalibrateOptions AccelerometerOptions(double gravity_mps2) {
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.reference.gravity_mps2 = {gravity_mps2, 0.0};
  return options;
}

}  // namespace truetriad
