// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// How the unit is turned from one pose of a program to the next, and how well a gyroscope measures
// such a turn.
struct PlannedTurns {
  TriadModel<double> gyroscope;
  bool is_bent = false;  // the gyroscope's axis terms are estimated, too
  double duration_s = 2.0;
  double rate_hz = 100.0;                                       // of the gyroscope's readings
  Eigen::Vector3d reading_sigma_raw = Eigen::Vector3d::Zero();  // σ of one reading
  double sigma_rad = 0.0;           // of a turn, beyond its readings' noise
  double attitude_sigma_rad = 0.0;  // of a pose, about each axis
  bool has_heading = true;          // the heading of the poses is known
};

// What exact sensors read while the unit is turned at one rate about one axis, the shortest way.
// `up`: specific force at rest in the world, m/s^2. The caller sets RecordedMove::from.
RecordedMove ExactMove(const Eigen::Quaterniond& from,
                       const Eigen::Quaterniond& to,
                       const PlannedTurns& turns,
                       const TriadModel<double>& accelerometer,
                       const Eigen::Vector3d& up);

// The poses in an order that needs little turning. Temperatures rise from pose to pose. At each
// temperature, the path starts at the last pose of the previous temperature and is the shortest one
// that nearest neighbours and 2-opt find.
//
//   `heading_counts`  false: only what is up matters, so headings are turned freely
std::vector<ProgramPose> OrderForOperator(std::vector<ProgramPose> poses, bool heading_counts);

// Orders the poses of a program so that the turns between them determine the gyroscope's matrix
// best: the determinant of their information is largest. The order of the temperatures stays.
// Reverses runs of poses and swaps pairs until neither of these increases the determinant.
std::vector<ProgramPose> OrderForGyroscope(const std::vector<ProgramPose>& poses,
                                           const PlannedTurns& turns);

}  // namespace truetriad
