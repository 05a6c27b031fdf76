// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Geometry>

namespace truetriad {

/// A cube in the given attitude as seen by somebody who looks north from a little above and to the
/// right: the body's axes x, y, z as coloured arrows out of its faces, north and up beside it.
std::string PosePicture(const Eigen::Quaterniond& world_from_body, std::string_view label);

}  // namespace truetriad
