// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace truetriad {

/// One pose that an operator, a fixture or the simulator is to take.
struct ProgramPose {
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();
  std::optional<double> temperature_degc;  ///< Chamber temperature; unset: not controlled.
  std::string label;                       ///< "x up, y to the north"; for the reader.
};

/// Poses in the order in which they are taken.
struct PoseProgram {
  std::vector<ProgramPose> poses;
};

}  // namespace truetriad
