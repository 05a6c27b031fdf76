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

// Below this |sin(dip)| the sign of the dip does not decide, the positive determinant does.
inline constexpr double kEquatorSine = 0.02;

// Dip of a field that is the vertical itself (CalibrateOptions::TurnsAgainstField).
inline constexpr double kVerticalFieldRad = 0.5 * std::numbers::pi;

// Where the optimiser may start: closed-form models of the triads, no guess from the user.
// docs/method.md, "Start values".
struct StartValues {
  PerTriad<std::optional<TriadModel<double>>> models;
  ReferenceVector reference = ReferenceVector::Zero();
  bool field_nominal = false;  // B could not be known and was fixed by convention
  // Of given attitudes: a frame that is level <- theirs. Identity where they are level themselves.
  Eigen::Quaterniond level_from_fixture = Eigen::Quaterniond::Identity();
};

// Where a graph stands, at the reference temperature.
StartValues StartAt(const PoseGraph& graph);

// Readings of `triad`, a pose each.
std::vector<Eigen::Vector3d> ReadingsOf(const PoseSet& poses, Triad triad);

// From where on a length's error, as a share of the field, is no work of noise or of a rough start,
// where `errors` are those of all readings. Nothing is, of too few.
double WildFrom(std::vector<double> errors);

// Median over the poses, axis by axis: a pose that was touched does not matter. Zero without poses.
Eigen::Vector3d MedianReading(const PoseSet& poses, Triad triad);

// Attitude of every pose by TRIAD (two triads) or as a direction (one), at the start values.
void SetStartAttitudes(const StartValues& start, PoseGraph* graph);

// Headings along the chains of turns, from the attitude of the first pose of each; tilts stay as
// they are. The held headings are then those.
void SetStartHeadings(PoseGraph* graph);

// Face of each pose (index in order +x, -x, +y, …), given or found; -1 without accelerometer.
Result<std::vector<int>> FacesOfPoses(const PoseSet& poses, const TriadOptions& accelerometer);

}  // namespace truetriad
