// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/outcome.h"

namespace truetriad {

// The problem of the shared parameters that is left when all other unknowns are eliminated.
class EliminatedProblem {
 public:
  virtual ~EliminatedProblem() = default;
  // Linearises at `shared`. The other unknowns are computed from the previous linearisation.
  virtual void Linearise(const Eigen::VectorXd& shared) = 0;
  // Half the sum of squares that a Linearise at `shared` would give; not finite if a row cannot be
  // evaluated.
  virtual double CostAt(const Eigen::VectorXd& shared) const = 0;
  // From the last Linearise: half the sum of squares, its gradient and information with respect to
  // the free shared coordinates.
  virtual double cost() const = 0;
  virtual const Eigen::VectorXd& gradient() const = 0;
  virtual const Eigen::MatrixXd& information() const = 0;
};

// Minimises over the shared parameters and all eliminated unknowns. Ceres is given only the shared
// parameters, and one cost function. Its residuals r and Jacobian J are a square root of the
// reduced system,
//
//   J^T J = information,  J^T r = gradient,  |r|^2 / 2 = cost
//
// On return the problem is linearised at `shared`, the optimum. Iteration stops when a step lowers
// the cost by less than the share `tolerance`.
SolveOutcome SolveEliminated(const SharedLayout& layout,
                             double tolerance,
                             int max_iterations,
                             EliminatedProblem* problem,
                             Eigen::VectorXd* shared);

}  // namespace truetriad
