// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// Directions of a vector sensor in the body frame, as inline SVG; the empty string when there is
// nothing to draw.

/// Raw and corrected readings on the sphere of what there is to read, errors enlarged, seen from
/// above and from the side. Its caption: SphereCaption.
std::string SphereChart(const Calibration& calibration, Triad triad);
std::string SphereCaption(const Calibration& calibration, Triad triad);

/// Directions of the poses on two Lambert equal-area discs, z up and z down; shaded: what is
/// further from every pose than kHoleDeg.
inline constexpr double kHoleDeg = 45.0;
std::string CoverageChart(const Quality& quality, Triad triad);
/// Of readings before any calibration; `unit`: their directions, pose by pose.
std::string CoverageChart(const std::vector<Eigen::Vector3d>& unit, Triad triad);
std::string CoverageCaption(Triad triad);

/// The pose that closes the largest gap of any vector sensor, where one is larger than kHoleDeg.
struct NextPose {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Body, of what the sensor reads.
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< x north, z up.
};
std::optional<NextPose> NextPoseFor(const Calibration& calibration);

}  // namespace truetriad
