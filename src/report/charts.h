// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "truetriad/base/triad.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

// The figures of pages, with their captions; empty where there is nothing to draw. Points are
// thinned, of neighbours the extremes kept, so that a figure's size does not grow with the poses.

/// A drawing of each sensor.
template <typename Draw>
std::vector<Drawing> OfEachSensor(const Draw& draw) {
  std::vector<Drawing> drawings;
  for (const Triad triad : kTriads) drawings.push_back(draw(triad));
  return drawings;
}

/// Each limit as a bar: the worst value with ±2σ against what is allowed.
Drawing LimitDrawing(const std::vector<LimitCheck>& limits);

/// Differences of two calibrations in σ, each with ±1, against ±2; entries without a σ are left
/// out.
Drawing DifferenceDrawing(const std::vector<ComparisonEntry>& entries);

/// Correlation of the parameters that are free, as a lower triangle of cells.
Drawing CorrelationDrawing(const NamedCovariance& covariance);

/// A compass is looked at each five degrees.
inline constexpr int kHeadings = 72;
/// What a compass is off by round the horizon, before and after; nothing without accelerometer and
/// magnetometer.
Drawing HeadingDrawing(const Calibration& calibration);

/// One sensor: what is left of each axis at each pose with ±3σ of the noise that weighted it, and
/// all against the quantiles of the normal distribution: the lengths of a vector, the axes of a
/// gyroscope at rest.
Drawing ResidualDrawing(const std::vector<PoseResidual>& poses,
                        const std::optional<TriadCalibration>& sensor,
                        Triad triad);

/// Turns: what was found less what was stated, ±2σ, and the error of each that was held out.
Drawing TurnDrawing(const RestQuality& quality);

/// A recording over time: readings of each sensor with rests shaded, those with rejected readings
/// crossed, what was left out, and the temperature of the rests. Nothing without times.
/// `leads_to_rows`: the page has a row for each pose.
Drawing TimelineDrawing(const PoseSet& poses,
                        const std::vector<RejectedPose>& rejected,
                        bool leads_to_rows);

/// One axis of a sweep: windows against temperature with the fit and ±2σ about it, and over time
/// what the fit leaves.
Drawing SweepFitDrawing(const Calibration& calibration, Triad triad, int axis);

/// Whether a lag of the axis is so long that its bias at a temperature and a rate depends on what
/// was before.
bool FollowsThePast(const Calibration& calibration, Triad triad, int axis);

/// One axis: the bias over temperature and its rate, as coloured cells. Nothing where it follows
/// the past.
Drawing SweepSurfaceDrawing(const Calibration& calibration, Triad triad, int axis);

/// What the poses at each temperature say of a sensor with temperature terms.
std::vector<TemperatureSetting> SettingsOf(const Calibration& calibration, Triad triad);

/// One axis: the bias that the poses of each temperature show by themselves, ±2σ, with what the
/// terms say, ±2σ; beside it the difference.
Drawing SoakDrawing(const Calibration& calibration, Triad triad, int axis);

/// A cube in the given attitude as seen by somebody who looks north from a little above and to the
/// right: the body's axes x, y, z as coloured arrows out of its faces, north and up beside it.
std::string PosePicture(const Eigen::Quaterniond& world_from_body, std::string_view label);

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
