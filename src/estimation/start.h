// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "estimation/graph.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/estimation/calibrate.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// Below this |sin(dip)| the sign of the dip does not decide, the positive determinant does.
inline constexpr double kEquatorSine = 0.02;

// Where the optimiser may start: closed-form models of the triads, no guess from the user.
// model.md §4.
struct StartValues {
  PerTriad<std::optional<TriadModel<double>>> models;
  ReferenceVector reference = ReferenceVector::Zero();
  bool field_nominal = false;  // B could not be known and was fixed by convention
  // Of given attitudes: a frame that is level <- theirs. Identity where they are level themselves.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();
};

// Median over the poses, axis by axis: a pose that was touched does not matter. Zero without poses.
Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad);

// Error (not enough) when a triad has fewer poses than its wanted model has parameters.
Status CheckPoseCounts(const PoseSet& poses, const CalibrateOptions& options);

// What readings that lie in one plane, or in one part of their ellipsoid, leave open: for the case
// that there is no start to analyse. Empty when they are spread out.
std::vector<WeakDirection> WeakDirectionsOfReadings(const PoseSet& poses,
                                                    const CalibrateOptions& options);

// All distinct starts worth trying, best first: one, or several when the magnetometer's rotation
// has rival solutions.
// Error: too few poses for the wanted model, poses that do not determine it (not enough); readings
// that cannot be in the stated unit (bad input).
Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options);

// Attitude of every pose by TRIAD (two triads) or as a direction (one), at the start values.
void SetStartAttitudes(const StartValues& start, PoseGraph* graph);

// Headings along the chains of turns, from the attitude of the first pose of each; tilts stay as
// they are. The held headings are then those.
void SetStartHeadings(PoseGraph* graph);

// Face of each pose (index in order +x, -x, +y, …), given or found; -1 without accelerometer.
Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, AccelerometerSign sign);

}  // namespace truetriad
