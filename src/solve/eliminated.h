// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/outcome.h"

namespace truetriad {

// What is left of a problem about the shared parameters when all other unknowns are eliminated.
class EliminatedProblem {
 public:
  virtual ~EliminatedProblem() = default;
  // Linearises at `shared`; the other unknowns follow from where they were linearised last.
  virtual void Linearise(const Eigen::VectorXd& shared) = 0;
  // Half the sum of squares where Linearise would go to; not finite where there is no answer.
  virtual double CostAt(const Eigen::VectorXd& shared) const = 0;
  // Of the last Linearise: half the sum of squares, and gradient and information about the free
  // shared coordinates.
  virtual double cost() const = 0;
  virtual const Eigen::VectorXd& gradient() const = 0;
  virtual const Eigen::MatrixXd& information() const = 0;
};

// Minimises over the shared parameters and all that was eliminated. Ceres sees the shared
// parameters alone, behind one cost whose residuals are a square root of the reduced system,
//
//   J^T J = information,  J^T r = gradient,  |r|^2 / 2 = cost
//
// On return the problem is linearised at `shared`, the optimum. It stops when a step lowers the
// cost by less than `tolerance` of it.
SolveOutcome SolveEliminated(const SharedLayout& layout,
                             double tolerance,
                             int max_iterations,
                             EliminatedProblem* problem,
                             Eigen::VectorXd* shared);

}  // namespace truetriad
