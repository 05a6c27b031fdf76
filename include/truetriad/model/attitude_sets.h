// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace truetriad {

/// The six faces of a block, each up once: +x, -x, +y, -y, +z, -z; heading as little turned as
/// possible. World <- body, as everywhere.
std::vector<Eigen::Quaterniond> SixFaceAttitudes();

/// The 24 orientations of a cube: six faces up, four headings each.
std::vector<Eigen::Quaterniond> CubeAttitudes();

/// `count` rotations spread evenly over SO(3), the same for every call: super-Fibonacci spirals.
/// M. Alexa, "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of SO(3)", CVPR 2022.
std::vector<Eigen::Quaterniond> SpreadAttitudes(int count);

/// An attitude as an operator would say it: "z up, x to the north" for the cube's orientations,
/// else "z up tilted 30 deg towards x, y 45 deg west of north"; always unambiguous.
std::string AttitudeInWords(const Eigen::Quaterniond& world_from_body);

}  // namespace truetriad
