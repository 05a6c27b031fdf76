// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/data/pose_program.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// How the unit is turned from one pose of a program into the next, and how well a gyroscope sees
// it.
struct PlannedTurns {
  TriadModel<double> gyroscope;
  bool is_bent = false;  // what it does differently both ways counts too
  double duration_s = 2.0;
  double rate_hz = 100.0;                                       // of the readings
  Eigen::Vector3d reading_sigma_raw = Eigen::Vector3d::Zero();  // of one of them
  double sigma_rad = 0.0;                                       // about each axis, beyond that
  double attitude_sigma_rad = 0.0;                              // of the poses, about each axis
  bool has_heading = true;                                      // they have known ones
};

// What exact sensors read while the unit is turned at one rate about one axis, the shortest way.
// `up`: specific force at rest in the world, m/s^2. RecordedMove::from is left to the caller.
RecordedMove ExactMove(const Eigen::Quaterniond& from,
                       const Eigen::Quaterniond& to,
                       const PlannedTurns& turns,
                       const TriadModel<double>& accelerometer,
                       const Eigen::Vector3d& up);

// The poses in an order that needs little turning: temperature by temperature, rising; in each the
// shortest round that nearest neighbours and 2-opt find, from the attitude of the pose before it.
//
//   `heading_counts`  false: only what is up matters, so headings are turned freely
std::vector<ProgramPose> OrderForOperator(std::vector<ProgramPose> poses, bool heading_counts);

// Orders the poses of a program so that the turns between them show the gyroscope's matrix best,
// temperatures from cold to hot as they are: the determinant of what the turns say of it. Stretches
// are turned about and poses swapped until that helps no more.
std::vector<ProgramPose> OrderForGyroscope(const std::vector<ProgramPose>& poses,
                                           const PlannedTurns& turns);

}  // namespace truetriad
