// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

#include "truetriad/base/units.h"

namespace truetriad::convert {

/// Roll, pitch and yaw in degrees by which a board is turned, body <- sensor, as autopilots number
/// them. MAVLink: MAV_SENSOR_ORIENTATION; ArduPilot: AP_Math/rotations.h; PX4:
/// lib/conversion/rotation.h.
inline constexpr std::array<std::array<double, 3>, 44> kBoardRotations = {{
    {0, 0, 0},     {0, 0, 45},    {0, 0, 90},        {0, 0, 135},   {0, 0, 180},   {0, 0, 225},
    {0, 0, 270},   {0, 0, 315},   {180, 0, 0},       {180, 0, 45},  {180, 0, 90},  {180, 0, 135},
    {0, 180, 0},   {180, 0, 225}, {180, 0, 270},     {180, 0, 315}, {90, 0, 0},    {90, 0, 45},
    {90, 0, 90},   {90, 0, 135},  {270, 0, 0},       {270, 0, 45},  {270, 0, 90},  {270, 0, 135},
    {0, 90, 0},    {0, 270, 0},   {0, 180, 90},      {0, 180, 270}, {90, 90, 0},   {180, 90, 0},
    {270, 90, 0},  {90, 180, 0},  {270, 180, 0},     {90, 270, 0},  {180, 270, 0}, {270, 270, 0},
    {90, 180, 90}, {90, 0, 270},  {90, 68.8, 293.3}, {0, 315, 0},   {90, 315, 0},  {0, 7, 0},
    {45, 0, 0},    {315, 0, 0},
}};
/// PX4 numbers the first of them, and has others behind.
inline constexpr std::size_t kPx4BoardRotations = 41;

/// Range: one of the numbers above.
inline Eigen::Matrix3d BoardRotation(std::size_t number) {
  const auto& [roll, pitch, yaw] = kBoardRotations[number];
  Eigen::Matrix3d rotation = (Eigen::AngleAxisd(yaw * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(pitch * kRadPerDeg, Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(roll * kRadPerDeg, Eigen::Vector3d::UnitX()))
                                 .toRotationMatrix();
  // Quarter turns exactly.
  for (double& entry : rotation.reshaped()) {
    if (std::abs(entry - std::round(entry)) < 1e-12) entry = std::round(entry) + 0.0;
  }
  return rotation;
}

}  // namespace truetriad::convert
