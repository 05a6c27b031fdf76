// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "model/board_rotation.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

// The name of the rotation by these angles: "ROLL_180_YAW_90"; "NONE" if all are zero.
std::string NameOfRotation(const std::array<double, 3>& turn_deg) {
  constexpr std::array<const char*, 3> kAxes = {"ROLL_", "PITCH_", "YAW_"};
  std::string name;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (turn_deg[axis] == 0.0) continue;
    if (!name.empty()) name += '_';
    name += kAxes[axis] + std::to_string(std::lround(turn_deg[axis]));
  }
  return name.empty() ? "NONE" : name;
}

// The axis map of the autopilots' rotation `name` (body <- sensor): the transpose of its matrix.
// Unset if the name is unknown or the rotation is not made of quarter turns.
std::optional<Eigen::Matrix3d> MapOfRotation(std::string_view name) {
  for (const std::array<double, 3>& turn_deg : kBoardRotations) {
    if (NameOfRotation(turn_deg) != name) continue;
    const Eigen::Matrix3d map = TurnOf(Eigen::Vector3d(turn_deg.data())).transpose();
    if (map == NearestAxisMap(map)) return map;
  }
  return std::nullopt;
}

}  // namespace

std::string AxisMapName(const Eigen::Matrix3d& map) {
  std::string name;
  for (int row = 0; row < 3; ++row) {
    Eigen::Index axis = 0;
    map.row(row).cwiseAbs().maxCoeff(&axis);
    name += map(row, axis) < 0.0 ? '-' : '+';
    name += AxisLetter(axis);
  }
  return name;
}

std::optional<Eigen::Matrix3d> AxisMapFromName(std::string_view name) {
  for (const std::string_view prefix : {"ROTATION_", "MAV_SENSOR_ROTATION_"}) {
    if (name.starts_with(prefix)) return MapOfRotation(name.substr(prefix.size()));
  }
  for (const Eigen::Matrix3d& map : AllAxisMaps()) {
    if (AxisMapName(map) == name) return map;
  }
  return std::nullopt;
}

std::vector<Eigen::Matrix3d> AllAxisMaps() {
  // 2^3 signs of three axes.
  constexpr int kSigns = 8;
  std::vector<Eigen::Matrix3d> maps;
  std::array<int, 3> columns = {0, 1, 2};
  do {
    for (int signs = 0; signs < kSigns; ++signs) {
      Eigen::Matrix3d& map = maps.emplace_back(Eigen::Matrix3d::Zero());
      for (int row = 0; row < 3; ++row) {
        map(row, columns[static_cast<std::size_t>(row)]) = (signs >> row & 1) != 0 ? -1.0 : 1.0;
      }
    }
  } while (std::next_permutation(columns.begin(), columns.end()));
  return maps;
}

Eigen::Matrix3d NearestAxisMap(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d unit = matrix.rowwise().normalized();
  std::array<int, 3> columns = {0, 1, 2};
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double best_score = -1.0;
  do {
    Eigen::Matrix3d map = Eigen::Matrix3d::Zero();
    double score = 0.0;
    for (int row = 0; row < 3; ++row) {
      const int col = columns[static_cast<std::size_t>(row)];
      map(row, col) = unit(row, col) < 0.0 ? -1.0 : 1.0;
      score += std::abs(unit(row, col));
    }
    if (score > best_score) {
      best_score = score;
      best = map;
    }
  } while (std::next_permutation(columns.begin(), columns.end()));
  return best;
}

int AxesThatDiffer(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  int count = 0;
  for (int row = 0; row < 3; ++row) count += a.row(row) != b.row(row) ? 1 : 0;
  return count;
}

}  // namespace truetriad
