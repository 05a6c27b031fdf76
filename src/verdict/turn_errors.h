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

// The vector sensor whose readings turns are compared with: the accelerometer, without one the
// magnetometer.
Triad TurnedAgainst(const SharedLayout& layout);

// Angle between `after` and the prediction from `before` by the turn; both are the same constant
// world direction, in body axes before and after; rad.
double TurnError(const Eigen::Quaterniond& turn,
                 const Eigen::Vector3d& before,
                 const Eigen::Vector3d& after);

// A gyroscope with nominal gains of its unit and the median of its readings at rest as bias; unset
// for counts.
std::optional<TriadModel<double>> NominalGyroscope(const PoseSet& poses);

// Angles between gravity (without accelerometer: the field) measured at the next rest and predicted
// by the turn, for several sets of parameters; rad. Turns that are rejected, or begin or end in a
// pose with a rejected reading, are left out, so that all lists are of the same turns.
struct TurnErrors {
  std::vector<double> in_sample;
  // With parameters estimated without the turn. Empty if such parameters would be undetermined.
  std::vector<double> held_out;
  // With a nominal gyroscope; the vector sensor is the calibrated one. Empty for counts.
  std::vector<double> nominal;
};

// The parameters without a turn come from one Gauss-Newton step: with the projector P of the whole
// system (reduced_system.h) and the turn's own rows f,
//
//   t_without = t + M^-1 (D J)_f^T (P_ff)^-1 (P r)_f
//
// exact for a linear graph; the turn is then integrated again. The error is of second order in a
// shift of the size of σ. Weights and excess noise are held.
TurnErrors FindTurnErrors(const PoseGraph& graph,
                          const ReducedSystem& system,
                          const PoseSet& poses);

}  // namespace truetriad
