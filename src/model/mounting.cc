// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/mounting.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// The map of MAVLink's MAV_SENSOR_ROTATION: "ROTATION_ROLL_180_YAW_90" is the rotation Rz(90 deg)
// Ry(0) Rx(180 deg) from sensor to body axes. Angles must be multiples of 90 deg.
std::optional<Eigen::Matrix3d> MapOfRotation(std::string_view name) {
  if (name == "NONE") return Eigen::Matrix3d::Identity();
  constexpr std::array<std::string_view, 3> kAxes = {"ROLL_", "PITCH_", "YAW_"};
  Eigen::Matrix3d sensor_from_body = Eigen::Matrix3d::Identity();
  bool is_rotation = false;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::string_view label = kAxes[static_cast<std::size_t>(axis)];
    if (!name.starts_with(label)) continue;
    name.remove_prefix(label.size());
    constexpr std::array<std::string_view, 3> kQuarters = {"90", "180", "270"};
    const auto angle = std::find_if(kQuarters.begin(), kQuarters.end(), [name](const auto& one) {
      return name.substr(0, name.find('_')) == one;
    });
    if (angle == kQuarters.end()) return std::nullopt;
    Eigen::Matrix3d quarter = Eigen::Matrix3d::Zero();  // from body axes
    const Eigen::Index next = (axis + 1) % 3, last = (axis + 2) % 3;
    quarter(axis, axis) = quarter(next, last) = 1.0;
    quarter(last, next) = -1.0;
    for (auto turn = kQuarters.begin(); turn <= angle; ++turn) sensor_from_body *= quarter;
    name.remove_prefix(std::min(name.size(), angle->size() + 1));
    is_rotation = true;
  }
  if (!is_rotation || !name.empty()) return std::nullopt;
  return sensor_from_body;
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
  constexpr std::string_view kRotation = "ROTATION_";
  if (name.starts_with(kRotation)) return MapOfRotation(name.substr(kRotation.size()));
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
