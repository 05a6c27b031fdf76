// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "faults/fault_system.h"
#include "faults/fault_test.h"
#include "noise/noise_settling.h"
#include "problem/graph.h"

namespace truetriad {

// The graph with what was taken in: readings that can be corrected and restored, variances that
// follow their likelihood, and the linear system of it all.
class TakenModel {
 public:
  TakenModel(PoseGraph* graph, NoiseState* noise);

  const FaultSystem& system() const { return system_; }
  const ExcessState& excess() const { return excess_; }
  const AddedColumns& added() const { return added_; }
  bool is_settled() const { return is_settled_; }

  // The columns in the model from here on.
  void SetColumns(AddedColumns added);
  // Variances by REML, at most so many steps, with what is in the model.
  void SettleExcess(int steps);
  void SetExcess(const Eigen::VectorXd& v);
  // With one more variance component of the turns, from nothing; without it (empty).
  void SetTurnVariances(TurnVariances unit);

  // Corrects the readings by h and solves again there: one Gauss-Newton step, turns integrated
  // anew. The columns are those of the solution before; SetColumns states those of the new one.
  void Relinearise();

  // What the graph alone, with its readings as they are corrected, says of the noise.
  void StateEstimate();
  // χ² of the corrected readings against the noise at rest alone. Last of all: the system is not
  // asked after it.
  double ChiSquareAtRest();

 private:
  void Apply(const Eigen::VectorXd& v);
  void CorrectReadings();

  PoseGraph* graph_;
  NoiseState* noise_;
  FaultSystem system_;
  ExcessState excess_;
  AddedColumns added_;
  TurnVariances turn_unit_;
  bool is_settled_ = true;
  // As the graph had them, of the poses' observations and of the turns as integrated last.
  std::vector<Eigen::Vector3d> readings_;
  std::vector<Eigen::Quaterniond> rotations_;
  std::vector<Eigen::Matrix3d> stated_covariance_;
};

}  // namespace truetriad
