// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "truetriad/base/triad.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

// The figures of pages, with their captions. A figure with nothing to draw is empty. If there are
// many points, only the lowest and the highest of each group of neighbours are drawn, which limits
// the size of the page.

/// Calls `draw` for each sensor and collects the drawings.
template <typename Draw>
std::vector<Drawing> OfEachSensor(const Draw& draw) {
  std::vector<Drawing> drawings;
  for (const Triad triad : kTriads) drawings.push_back(draw(triad));
  return drawings;
}

/// Each limit is drawn as a bar: the worst value with ±2σ, compared with the allowed interval.
Drawing LimitDrawing(const std::vector<LimitCheck>& limits);

/// Differences of two calibrations in units of their σ, each with ±1 σ, above a band of ±2 σ.
/// Entries without a σ are left out.
Drawing DifferenceDrawing(const std::vector<ComparisonEntry>& entries);

/// The correlations of the free parameters as a lower triangle of cells.
Drawing CorrelationDrawing(const NamedCovariance& covariance);

/// Number of headings at which the heading error is computed, 360°/72 = 5° apart.
inline constexpr int kHeadings = 72;
/// The heading error of a compass round the horizon, before and after the calibration. It is empty
/// without an accelerometer or a magnetometer.
Drawing HeadingDrawing(const Calibration& calibration);

/// One sensor: the residual of each axis at each pose, with ±3σ of the noise used for the weight.
/// Beside it, errors against the quantiles of the normal distribution: errors of length for a
/// vector sensor, residuals of each axis for a gyroscope at rest.
Drawing ResidualDrawing(const std::vector<PoseResidual>& poses,
                        const std::optional<TriadCalibration>& sensor,
                        Triad triad);

/// Turns: the estimated minus the stated angle with ±2σ, and the error of each held-out turn.
Drawing TurnDrawing(const RestQuality& quality);

/// A recording over time: readings of each sensor with rests shaded and rejected rests crossed, the
/// intervals left out, and the temperature of the rests. Empty if the poses have no times.
/// `leads_to_rows`: the page has a table row for each pose, and each rest links to its row.
Drawing TimelineDrawing(const PoseSet& poses,
                        const std::vector<RejectedPose>& rejected,
                        bool leads_to_rows);

/// One axis of a sweep: its windows against temperature with the fit and ±2σ about it, and the
/// residuals of the fit over time.
Drawing SweepFitDrawing(const Calibration& calibration, Triad triad, int axis);

/// Whether a lag of the axis is so long that its bias at a given temperature and rate depends on
/// the temperatures before.
bool FollowsThePast(const Calibration& calibration, Triad triad, int axis);

/// One axis: the bias over temperature and the temperature's rate, as coloured cells. Empty if
/// FollowsThePast.
Drawing SweepSurfaceDrawing(const Calibration& calibration, Triad triad, int axis);

/// The bias at each temperature setting, from the poses at this temperature alone. Empty without
/// temperature terms.
std::vector<TemperatureSetting> SettingsOf(const Calibration& calibration, Triad triad);

/// One axis: the bias that the poses of each temperature give by themselves, and the bias that the
/// temperature terms predict with ±2σ; beside them the difference with ±2σ.
Drawing SoakDrawing(const Calibration& calibration, Triad triad, int axis);

/// A cube in the given attitude, seen by an observer who looks north from a little above and to the
/// right. Coloured arrows are the body axes x, y, z; north and up are drawn beside the cube.
std::string PosePicture(const Eigen::Quaterniond& world_from_body, std::string_view label);

/// A vector sensor's reading at one pose, in units of the field that it senses, body frame. Without
/// errors the reading lies on the unit sphere.
struct SpherePoint {
  int pose = 0;                                         ///< StaticPose::number.
  bool is_rejected = false;                             ///< Not part of the solution.
  Eigen::Vector3d truth = Eigen::Vector3d::UnitZ();     ///< Where the reading should be.
  Eigen::Vector3d raw = Eigen::Vector3d::Zero();        ///< The reading by nominal gains.
  Eigen::Vector3d corrected = Eigen::Vector3d::Zero();  ///< The reading by the calibration.
};

/// One point for each pose, in their order, at the reference temperature. If the readings are
/// counts without a nominal gain, they are divided by the mean of the estimated gains. Empty for a
/// gyroscope, without rests or if the field is unknown.
std::vector<SpherePoint> SpherePoints(const Calibration& calibration, Triad triad);

/// The factor 1, 2, 5, 10, 20 ... by which errors are enlarged: the largest that keeps the greatest
/// raw error within 0.4 radii; 1 if an error is greater than that.
double SphereMagnification(const std::vector<SpherePoint>& points);

/// How far from the centre the furthest raw reading is drawn, in radii; at least 1.
double SphereReach(const std::vector<SpherePoint>& points, double factor);

/// Thins to about `most` points: keeps all rejected ones and, of each group of neighbours, the one
/// with the greatest error after the calibration.
std::vector<SpherePoint> GreatestOfRuns(const std::vector<SpherePoint>& points, std::size_t most);

/// The direction in the body frame in which a sensor's bias has its largest σ. It exists only if
/// this σ is clearly larger than the others. True unit.
struct WeakAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double sigma = 0.0;   ///< The σ along the axis.
  double across = 0.0;  ///< The largest σ at right angles to it; at most sigma / 2.
};
std::optional<WeakAxis> WeakAxisOf(const Calibration& calibration, Triad triad);

/// The reading with its error from the truth multiplied by the factor.
inline Eigen::Vector3d Magnified(const Eigen::Vector3d& reading,
                                 const Eigen::Vector3d& truth,
                                 double factor) {
  return truth + factor * (reading - truth);
}

/// Raw and corrected readings on the unit sphere, errors enlarged, from above and from the side.
/// `turns`: the drawing also holds data for sphere.js. If the page has Plotly and the browser has
/// WebGL, sphere.js replaces the drawing by a sphere that can be turned.
Drawing SphereDrawing(const Calibration& calibration, Triad triad, bool turns);

/// Directions of the poses on two Lambert equal-area discs, z up and z down. Directions further
/// from every pose than kHoleDeg, half the 90° between two faces of a cube, are shaded.
inline constexpr double kHoleDeg = 45.0;
Drawing CoverageDrawing(const Quality& quality, Triad triad);
/// The same drawing for readings before any calibration; `unit` holds the direction of the reading
/// at each pose.
Drawing CoverageDrawing(const std::vector<Eigen::Vector3d>& unit, Triad triad);

/// The pose that closes the largest gap of any vector sensor, if a gap is larger than kHoleDeg.
struct NextPose {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< What the sensor reads, body frame.
  Eigen::Quaterniond world_from_body = Eigen::Quaterniond::Identity();  ///< World: x north, z up.
};
std::optional<NextPose> NextPoseFor(const Calibration& calibration);
/// A picture of the pose of NextPoseFor.
Drawing NextPoseDrawing(const Calibration& calibration);

}  // namespace truetriad
