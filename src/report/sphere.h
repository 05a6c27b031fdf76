// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

/// What a vector sensor read at one pose, in shares of what there is to read: without errors each
/// is a point of the unit sphere. Body frame.
struct SpherePoint {
  int pose = 0;                                         ///< StaticPose::number.
  bool is_rejected = false;                             ///< Not part of the solution.
  Eigen::Vector3d truth = Eigen::Vector3d::UnitZ();     ///< Where the reading should be.
  Eigen::Vector3d raw = Eigen::Vector3d::Zero();        ///< As nominal gains make of it.
  Eigen::Vector3d corrected = Eigen::Vector3d::Zero();  ///< As the calibration makes of it.
};

/// One point a pose, in their order, at the reference temperature. Counts of unknown size are taken
/// by their mean gain. Empty of a gyroscope, without rests, and where the field is unknown.
std::vector<SpherePoint> SpherePoints(const Calibration& calibration, Triad triad);

/// 1, 2, 5, 10, 20 ...: by how much to enlarge errors, so that the greatest of the raw ones is seen
/// and is not beyond 0.4 radii; 1 where they are greater.
double SphereMagnification(const std::vector<SpherePoint>& points);

/// How far from the centre the furthest raw reading is drawn, in radii; at least 1.
double SphereReach(const std::vector<SpherePoint>& points, double factor);

/// At most about `most`: rejected ones all, and of each run of neighbours that with the greatest
/// error after the calibration.
std::vector<SpherePoint> GreatestOfRuns(const std::vector<SpherePoint>& points, std::size_t most);

/// The body axis along which a sensor's bias is known worst, where that is clearly one: true unit.
struct WeakAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double sigma = 0.0;   ///< Along it.
  double across = 0.0;  ///< The largest at right angles to it; sigma is twice that at least.
};
std::optional<WeakAxis> WeakAxisOf(const Calibration& calibration, Triad triad);

/// A reading with its error from the truth enlarged.
inline Eigen::Vector3d Magnified(const Eigen::Vector3d& reading,
                                 const Eigen::Vector3d& truth,
                                 double factor) {
  return truth + factor * (reading - truth);
}

/// Raw and corrected readings on the sphere of what there is to read, errors enlarged, seen from
/// above and from the side. `turns`: with the data from which sphere.js draws a sphere in its place
/// that turns, where Plotly is in the page and the browser has WebGL.
Drawing SphereDrawing(const Calibration& calibration, Triad triad, bool turns);

/// Directions of the poses on two Lambert equal-area discs, z up and z down; shaded: what is
/// further from every pose than kHoleDeg, half the angle between two faces of a cube.
inline constexpr double kHoleDeg = 45.0;
Drawing CoverageDrawing(const Quality& quality, Triad triad);
/// Of readings before any calibration; `unit`: their directions, pose by pose.
Drawing CoverageDrawing(const std::vector<Eigen::Vector3d>& unit, Triad triad);

/// The pose that closes the largest gap of any vector sensor, where one is larger than kHoleDeg.
struct NextPose {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Body, of what the sensor reads.
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< x north, z up.
};
std::optional<NextPose> NextPoseFor(const Calibration& calibration);
/// A picture of it.
Drawing NextPoseDrawing(const Calibration& calibration);

}  // namespace truetriad
