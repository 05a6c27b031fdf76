// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

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

}  // namespace truetriad
