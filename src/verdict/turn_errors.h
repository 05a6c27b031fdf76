// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// The vector sensor with whose readings turns are compared: the accelerometer, or if there is none,
// the magnetometer.
Triad TurnedAgainst(const SharedLayout& layout);

// Angle, rad, between `after` and its prediction, which is `before` rotated by the turn. `before`
// and `after` are the same world direction, in body axes before and after the turn.
double TurnError(const Eigen::Quaterniond& turn,
                 const Eigen::Vector3d& before,
                 const Eigen::Vector3d& after);

// A gyroscope with the nominal gain of its unit, and as bias the median of its readings at rest.
// Unset if there is no gyroscope, or if its unit is counts.
std::optional<TriadModel<double>> NominalGyroscope(const PoseSet& poses);

// Angles, rad, between gravity as measured at the rest after a turn and gravity as predicted by the
// turn, for several sets of parameters. Without an accelerometer, the field replaces gravity. Turns
// are left out if they are rejected, or if they begin or end in a pose whose reading is rejected.
// All lists are of the same turns.
struct TurnErrors {
  std::vector<double> in_sample;
  // With parameters that are estimated without the turn. Empty if there is a turn without which the
  // parameters are undetermined.
  std::vector<double> held_out;
  // With a nominal gyroscope and the calibrated vector sensor. Empty if the unit is counts.
  std::vector<double> nominal;
};

// Finds the errors of all turns. One Gauss-Newton step gives the parameters without a turn: with
// the projector P of the whole system (reduced_system.h) and the rows f of the turn,
//
//   t_without = t + M^-1 (D J)_f^T (P_ff)^-1 (P r)_f
//
// This is exact for a linear graph; otherwise the error is of second order in the shift, which is
// of the size of σ. The turn is then integrated again. Weights and excess noise are held.
TurnErrors FindTurnErrors(const PoseGraph& graph,
                          const ReducedSystem& system,
                          const PoseSet& poses);

}  // namespace truetriad
