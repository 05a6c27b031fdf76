// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "model/gyro_increment.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// A turn, and how a direction that is fixed in the world, such as up, appears in the body frame.
struct DirectionMove {
  GyroMove move;
  Eigen::Vector3d before = Eigen::Vector3d::UnitZ();  ///< Unit vector at rest before the turn.
  Eigen::Vector3d after = Eigen::Vector3d::UnitZ();
  /// The direction at each gyroscope reading, of any length; the motion may disturb it.
  std::vector<Eigen::Vector3d> direction;
};

/// Sensitivity of a gyroscope of any unit and any order of axes, raw per rad/s, body frame, without
/// an initial guess: du/dt = u x C (y - b) is linear in C. Refined with the directions at rest.
/// Error (not enough): the turns do not determine all nine entries.
Result<Eigen::Matrix3d> FindGyroSensitivity(const std::vector<DirectionMove>& moves,
                                            const Eigen::Vector3d& bias_raw);

/// Sensitivity and bias of a gyroscope of a unit that never rests: C and C b enter du/dt linearly.
/// No direction is measured at rest, so that nothing is refined. A given sensitivity or bias is
/// held. Error (not enough): the motion does not determine them.
Result<TriadModel<double>> FindGyroModel(const std::vector<DirectionMove>& moves,
                                         const std::optional<Eigen::Matrix3d>& sensitivity,
                                         const std::optional<Eigen::Vector3d>& bias_raw);

}  // namespace truetriad
