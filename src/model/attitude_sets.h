// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace truetriad {

/// The attitudes, world <- body, of a block with +x, -x, +y, -y, +z, -z up in turn. Each is the
/// smallest rotation that points this face up.
std::vector<Eigen::Quaterniond> SixFaceAttitudes();

/// The 24 orientations of a cube: six faces up, four headings each.
std::vector<Eigen::Quaterniond> CubeAttitudes();

/// Attitudes that can be set by hand and eye: each face, edge and corner of a cube up (26
/// directions), four headings each.
std::vector<Eigen::Quaterniond> HandAttitudes();

/// `count` rotations spread evenly over SO(3), the same in every call: super-Fibonacci spirals.
/// M. Alexa, "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of SO(3)", CVPR 2022.
std::vector<Eigen::Quaterniond> SpreadAttitudes(int count);

/// Describes an attitude for an operator, in whole degrees. Orientations of the cube: "z up, x to
/// the north". Other attitudes: "-z up, x 20 deg above level, y 5 deg below level, x 45 deg west of
/// north". The body axis nearest to the vertical comes first. The elevations of the other two axes
/// state the tilt, and the azimuth of the first of these two states the heading.
std::string AttitudeInWords(const Eigen::Quaterniond& world_from_body);

}  // namespace truetriad
