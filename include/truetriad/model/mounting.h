// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// The mounting of a triad: a signed permutation of axes whose row i is the body axis along which
/// sensing axis i points, so that sensitivity = gains * map apart from misalignment. Its text
/// "+y+x-z" means: sensing x along body +y, y along +x, z along -z. AxisMapFromName also reads
/// names of MAVLink's MAV_SENSOR_ORIENTATION, such as "ROTATION_ROLL_180_YAW_90", if the rotation
/// is by quarter turns.
std::string AxisMapName(const Eigen::Matrix3d& map);
std::optional<Eigen::Matrix3d> AxisMapFromName(std::string_view name);

/// All 48 signed permutations, identity first; the right-handed ones have determinant +1.
std::vector<Eigen::Matrix3d> AllAxisMaps();

/// The signed permutation nearest to `matrix` with its rows scaled to length 1.
Eigen::Matrix3d NearestAxisMap(const Eigen::Matrix3d& matrix);

/// The number of rows in which two maps differ.
int AxesThatDiffer(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

}  // namespace truetriad
