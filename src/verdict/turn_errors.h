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

// The vector sensor that turns are measured against: the accelerometer, without one the
// magnetometer.
Triad TurnedAgainst(const SharedLayout& layout);

// Angle between `after` and where the turn puts `before`, two directions that stand still in the
// world as the body sees them; rad.
double TurnError(const Eigen::Quaterniond& turn,
                 const Eigen::Vector3d& before,
                 const Eigen::Vector3d& after);

// A gyroscope as its unit says, with the median of its readings at rest as its bias; unset for
// counts.
std::optional<TriadModel<double>> NominalGyroscope(const PoseSet& poses);

// How far gravity (without accelerometer: the field) at the next rest, as its sensor shows it, is
// from where a turn puts it, in several ways; rad. Turns that do not count, or begin or end in a
// pose whose sensor does not, are left out, so that all lists are of the same turns.
struct TurnErrors {
  std::vector<double> in_sample;
  // With parameters that have not seen the turn. Empty where they would not be determined.
  std::vector<double> held_out;
  // With a nominal gyroscope; that sensor is the calibrated one. Empty for counts.
  std::vector<double> nominal;
};

// The parameters without a turn come from one Gauss-Newton step: with the projector P of the whole
// system (reduced_system.h) and the turn's own rows f,
//
//   t_without = t + M^-1 (D J)_f^T (P_ff)^-1 (P r)_f
//
// exact for a linear graph; the turn is then integrated again. What is missed is of second order
// in a shift of the size of σ. Weights and excess noise stay as they are.
TurnErrors FindTurnErrors(const PoseGraph& graph,
                          const ReducedSystem& system,
                          const PoseSet& poses);

}  // namespace truetriad
