// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace truetriad {

/// The vectors that a unit at rest senses, in the world frame: x horizontal to magnetic north, z
/// up, y = z × x to the west. docs/conventions.md, "Frames".

/// Rotation rate of the Earth relative to the stars (WGS 84).
inline constexpr double kEarthRateRadps = 7.292115e-5;

/// Specific force at rest, m/s^2: (0, 0, g).
inline Eigen::Vector3d ForceInWorld(double gravity_mps2) { return {0.0, 0.0, gravity_mps2}; }

/// Magnetic flux density, µT: B (cos δ cos ψ, cos δ sin ψ, -sin δ). The dip δ is positive where the
/// field points down. The heading ψ is zero unless a fixture defines the world's x axis.
inline Eigen::Vector3d FieldInWorld(double field_ut, double dip_rad, double heading_rad = 0.0) {
  return field_ut * Eigen::Vector3d(std::cos(dip_rad) * std::cos(heading_rad),
                                    std::cos(dip_rad) * std::sin(heading_rad),
                                    -std::sin(dip_rad));
}

/// Earth rate, rad/s: Ω (cos φ cos D, cos φ sin D, sin φ). Latitude φ is positive in the north;
/// declination D is positive if magnetic north lies east of true north.
inline Eigen::Vector3d EarthRateInWorld(double latitude_rad,
                                        double declination_rad,
                                        double rate_radps = kEarthRateRadps) {
  return rate_radps * Eigen::Vector3d(std::cos(latitude_rad) * std::cos(declination_rad),
                                      std::cos(latitude_rad) * std::sin(declination_rad),
                                      std::sin(latitude_rad));
}

}  // namespace truetriad
