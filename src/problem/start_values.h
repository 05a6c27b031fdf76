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

// Least |sin(dip)| (1.15 degrees) for which the sign of the dip determines the hemisphere; below
// it, handedness decides.
inline constexpr double kEquatorSine = 0.02;

// Dip of a field that itself defines the vertical (CalibrateOptions::TurnsAgainstField).
inline constexpr double kVerticalFieldRad = 0.5 * std::numbers::pi;

// Start of the optimiser: closed-form models of the triads, without a guess by the user.
// docs/method.md, "Start values".
struct StartValues {
  PerTriad<std::optional<TriadModel<double>>> models;
  ReferenceVector reference = ReferenceVector::Zero();
  bool field_nominal = false;  // B is unknown and fixed by convention
  // Rotation from the frame of given attitudes to the level frame; identity if that frame is level.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();
};

// The values of a graph as start values, at the reference temperature.
StartValues StartAt(const PoseGraph& graph);

// Readings of `triad`, one per pose.
std::vector<Eigen::Vector3d> ReadingsOf(const PoseSet& poses, Triad triad);

// Above this length error, as a share of the field, a reading is disturbed: neither noise nor a
// rough start explains the error. `errors`: those of all readings. Infinite if there are too few
// errors.
double WildFrom(std::vector<double> errors);

// Median over the poses, axis by axis, which one disturbed pose hardly changes. Zero without poses.
Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad);

// Sets the attitudes that are not given, by TRIAD (two sensors) or as a direction (one sensor).
void SetStartAttitudes(const StartValues& start, PoseGraph* graph);

// Propagates headings along each chain of turns, beginning at the chain's first pose; tilts do not
// change. Held headings are set to the result.
void SetStartHeadings(PoseGraph* graph);

// Face of each pose (index in order +x, -x, +y, …), stated or found; -1 without accelerometer.
Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, const TriadOptions& accelerometer);

}  // namespace truetriad
