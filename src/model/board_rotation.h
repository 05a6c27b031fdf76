// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Geometry>

#include "truetriad/base/triad.h"

namespace truetriad {

/// The board rotations of autopilots: roll, pitch and yaw, deg, body <- sensor. The index is the
/// rotation's number in MAVLink (MAV_SENSOR_ORIENTATION), ArduPilot (AP_Math/rotations.h) and PX4
/// (lib/conversion/rotation.h).
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
/// PX4 agrees in the first 41 rotations; its higher numbers stand for other rotations.
inline constexpr std::size_t kPx4BoardRotations = 41;

/// Roll, pitch and yaw, deg, of rotation `number`; unset unless it is a whole number below `count`.
inline std::optional<Eigen::Vector3d> BoardTurnDeg(double number, std::size_t count) {
  const bool is_known = number >= 0.0 && number < static_cast<double>(count);
  if (!is_known || number != std::floor(number)) return std::nullopt;
  return Eigen::Vector3d(kBoardRotations[static_cast<std::size_t>(number)].data());
}

/// The rotation matrix: roll first, then pitch, then yaw.
inline Eigen::Matrix3d TurnOf(const Eigen::Vector3d& roll_pitch_yaw_deg) {
  const Eigen::Vector3d angles = kRadPerDeg * roll_pitch_yaw_deg;
  Eigen::Matrix3d rotation = (Eigen::AngleAxisd(angles[2], Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(angles[1], Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitX()))
                                 .toRotationMatrix();
  // Rounding makes quarter turns exact.
  for (double& entry : rotation.reshaped()) {
    if (std::abs(entry - std::round(entry)) < 1e-12) entry = std::round(entry) + 0.0;
  }
  return rotation;
}

/// The smallest angle above zero of all board rotations; autopilots cannot state a smaller one.
inline double SmallestBoardTurnDeg() {
  double smallest = 180.0;
  for (const std::array<double, 3>& turn_deg : kBoardRotations) {
    const double angle = Eigen::AngleAxisd(TurnOf(Eigen::Vector3d(turn_deg.data()))).angle();
    if (angle > 0.0) smallest = std::min(smallest, angle * kDegPerRad);
  }
  return smallest;
}

/// Roll, pitch and yaw of a rotation matrix: TurnOf(TurnDegOf(R)) = R.
inline Eigen::Vector3d TurnDegOf(const Eigen::Matrix3d& rotation) {
  // At a pitch of ±90° roll and yaw turn about the same axis, and roll is set to zero.
  const bool is_upright = std::abs(rotation(2, 0)) > 1.0 - 1e-12;
  const Eigen::Vector3d angles(is_upright ? 0.0 : std::atan2(rotation(2, 1), rotation(2, 2)),
                               -std::asin(std::clamp(rotation(2, 0), -1.0, 1.0)),
                               is_upright ? std::atan2(-rotation(0, 1), rotation(1, 1))
                                          : std::atan2(rotation(1, 0), rotation(0, 0)));
  // Rounding to 1e-9° makes whole degrees exact.
  return (1e9 * kDegPerRad * angles).array().round().matrix() / 1e9 + Eigen::Vector3d::Zero();
}

}  // namespace truetriad
