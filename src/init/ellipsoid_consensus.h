// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// The readings about the ellipsoid that most of them share, in their order: up to a quarter may be
/// anything. Empty where no ellipsoid is found; to say whether they determine it is left to
/// FitEllipsoid. The same readings always give the same answer.
std::vector<Eigen::Vector3d> ReadingsOfOneEllipsoid(const std::vector<Eigen::Vector3d>& readings,
                                                    bool axis_aligned);

}  // namespace truetriad
