// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"
#include "faults/fault_test.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"

namespace truetriad {

// A graph with its accepted faults. Its linear system contains their columns, its readings can be
// corrected for them and restored, and its variances are estimated with them included.
class TakenModel {
 public:
  // `system`: the linear system of `graph`.
  TakenModel(const ReducedSystem& system, PoseGraph* graph, NoiseState* noise);

  const FaultSystem& system() const { return system_; }
  const ExcessState& excess() const { return excess_; }
  const AddedColumns& added() const { return added_; }
  bool is_settled() const { return is_settled_; }

  // Sets the columns of all accepted faults, and corrects the readings by Z h, h = added.at.
  void SetColumns(AddedColumns added);
  // Estimates the excess variances of poses and of turns by REML, with all columns that the model
  // has now, in at most `steps` steps.
  void SettleExcess(int steps);
  void SetExcess(const Eigen::VectorXd& v);
  // Sets a second variance component of turns, in addition to their excess; a new one starts at
  // zero. If `unit` is empty, removes the component.
  void SetTurnVariances(TurnVariances unit);

  // Corrects the readings by the present h, then takes one Gauss-Newton step and integrates the
  // turns again. The columns are not computed again here: call SetColumns next.
  void Relinearise();

  // Computes the noise estimate from the corrected readings, as for a graph without faults.
  void StateEstimate();
  // χ² of the corrected readings with the noise at rest alone. It must be the last call, since it
  // invalidates the system.
  double ChiSquareAtRest();

 private:
  void Apply(const Eigen::VectorXd& v);
  Eigen::VectorXd Correction() const;
  void CorrectReadings(const Eigen::VectorXd& off);

  PoseGraph* graph_;
  NoiseState* noise_;
  FaultSystem system_;
  ExcessState excess_;
  AddedColumns added_;
  Eigen::VectorXd corrected_by_;
  bool is_linearised_ = true;  // whether system_ is up to date with corrected_by_
  TurnVariances turn_unit_;
  bool is_settled_ = true;
  // The graph's values without the faults: the poses' readings, the turns' rotations as last
  // integrated, and the turns' stated covariances.
  std::vector<Eigen::Vector3d> readings_;
  std::vector<Eigen::Quaterniond> rotations_;
  std::vector<Eigen::Matrix3d> stated_covariance_;
};

}  // namespace truetriad
