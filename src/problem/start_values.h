// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/graph.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Below this |sin(dip)|, at 1.15 degrees, the handedness decides, not the sign of the dip.
inline constexpr double kEquatorSine = 0.02;

// Dip of a field that is the vertical itself (CalibrateOptions::TurnsAgainstField).
inline constexpr double kVerticalFieldRad = 0.5 * std::numbers::pi;

// Start of the optimiser: closed-form models of the triads, without a guess by the user.
// docs/method.md, "Start values".
struct StartValues {
  PerTriad<std::optional<TriadModel<double>>> models;
  ReferenceVector reference = ReferenceVector::Zero();
  bool field_nominal = false;  // B is unknown and fixed by convention
  // For given attitudes: level <- their frame; identity where their frame is level.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();
};

// The values of a graph as start values, at the reference temperature.
StartValues StartAt(const PoseGraph& graph);

// Readings of `triad`, one per pose.
std::vector<Eigen::Vector3d> ReadingsOf(const PoseSet& poses, Triad triad);

// Threshold, as a share of the field, above which a length error is due neither to noise nor to a
// rough start; `errors` are those of all readings. Infinite if there are too few.
double WildFrom(std::vector<double> errors);

// Median over the poses, axis by axis, which one disturbed pose hardly changes. Zero without poses.
Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad);

// Attitude of every pose by TRIAD (two triads) or as a direction (one), at the start values.
void SetStartAttitudes(const StartValues& start, PoseGraph* graph);

// Propagates headings along the chains of turns, from the first pose of each; tilts do not change.
// Held headings are set to the result.
void SetStartHeadings(PoseGraph* graph);

// Face of each pose (index in order +x, -x, +y, …), stated or found; -1 without accelerometer.
Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, const TriadOptions& accelerometer);

}  // namespace truetriad
