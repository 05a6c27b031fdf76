// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"
#include "faults/fault_test.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"

namespace truetriad {

// The graph with accepted faults. Its readings can be corrected for them and restored, its
// variances are at their optimum, and its linear system includes the faults.
class TakenModel {
 public:
  // `system`: of the graph.
  TakenModel(const ReducedSystem& system, PoseGraph* graph, NoiseState* noise);

  const FaultSystem& system() const { return system_; }
  const ExcessState& excess() const { return excess_; }
  const AddedColumns& added() const { return added_; }
  bool is_settled() const { return is_settled_; }

  // Sets the columns of all accepted faults, and corrects the readings by Z h, h = added.at.
  void SetColumns(AddedColumns added);
  // Estimates variances by REML with the present model, in at most `steps` steps.
  void SettleExcess(int steps);
  void SetExcess(const Eigen::VectorXd& v);
  // Sets a second variance component of the turns, at first zero, or removes it if `unit` is empty.
  void SetTurnVariances(TurnVariances unit);

  // Corrects the readings by h and solves again: one Gauss-Newton step, with turns integrated
  // again. The columns are still of the former solution, so that SetColumns must follow.
  void Relinearise();

  // Computes the noise estimate of the corrected readings, as that of a graph without faults.
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
  bool is_linearised_ = true;  // with readings corrected by corrected_by_
  TurnVariances turn_unit_;
  bool is_settled_ = true;
  // Uncorrected values: of the poses' observations, and of the turns as last integrated.
  std::vector<Eigen::Vector3d> readings_;
  std::vector<Eigen::Quaterniond> rotations_;
  std::vector<Eigen::Matrix3d> stated_covariance_;
};

}  // namespace truetriad
