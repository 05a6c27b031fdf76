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

// Least |sin(dip)| (1.15 degrees) for which the sign of the dip determines the hemisphere. If it is
// smaller, handedness decides.
inline constexpr double kEquatorSine = 0.02;

// Dip of a field that itself defines the vertical (CalibrateOptions::TurnsAgainstField).
inline constexpr double kVerticalFieldRad = 0.5 * std::numbers::pi;

// The values from which the optimiser starts: closed-form models of the triads, which need no guess
// by the user. docs/method.md, "Start values".
struct StartValues {
  PerTriad<std::optional<TriadModel<double>>> models;
  ReferenceVector reference = ReferenceVector::Zero();
  bool field_nominal = false;  // B is unknown and held at a conventional value
  // Rotation from the frame of given attitudes to the level frame; identity if that frame is level.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();
};

// The values of a graph as start values, at the reference temperature.
StartValues StartAt(const PoseGraph& graph);

// Readings of `triad`, one per pose.
std::vector<Eigen::Vector3d> ReadingsOf(const PoseSet& poses, Triad triad);

// If the length error of a reading, as a share of the field, exceeds this value, the reading is
// disturbed: neither noise nor a rough start explains the error. `errors`: the errors of all
// readings. Infinite if there are too few errors.
double WildFrom(std::vector<double> errors);

// The median reading over the poses, axis by axis. One disturbed pose hardly changes it. Zero
// without poses.
Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad);

// Sets the attitudes that are not given, by TRIAD (two sensors) or as a direction (one sensor).
void SetStartAttitudes(const StartValues& start, PoseGraph* graph);

// Propagates headings along each chain of turns, beginning at the chain's first pose; tilts do not
// change. Held headings are set to the result.
void SetStartHeadings(PoseGraph* graph);

// The face that points up in each pose, as an index in the order +x, -x, +y, …, from the labels or
// the readings; -1 without accelerometer.
Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, const TriadOptions& accelerometer);

}  // namespace truetriad
