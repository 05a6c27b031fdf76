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
  double duration_s = 2.0;
  double rate_hz = 100.0;                                       // of the readings
  Eigen::Vector3d reading_sigma_raw = Eigen::Vector3d::Zero();  // of one of them
  double sigma_rad = 0.0;                                       // about each axis, beyond that
};

// What exact sensors read while the unit is turned at one rate about one axis, the shortest way.
// `up`: specific force at rest in the world, m/s^2. RecordedMove::from is left to the caller.
RecordedMove ExactMove(const Eigen::Quaterniond& from,
                       const Eigen::Quaterniond& to,
                       const PlannedTurns& turns,
                       const TriadModel<double>& gyroscope,
                       const TriadModel<double>& accelerometer,
                       const Eigen::Vector3d& up);

// Orders the poses of a program so that the turns between them show the gyroscope's matrix best,
// temperatures from cold to hot as they are: the determinant of what the turns say of it, attitudes
// known to `attitude_sigma_rad` about each axis, and their headings if `has_heading`. Stretches are
// turned about until that helps no more. `is_bent`: what a gyroscope does differently both ways
// counts too.
std::vector<ProgramPose> OrderForGyroscope(std::vector<ProgramPose> poses,
                                           const PlannedTurns& turns,
                                           const TriadModel<double>& gyroscope,
                                           double attitude_sigma_rad,
                                           bool has_heading,
                                           bool is_bent);

}  // namespace truetriad
