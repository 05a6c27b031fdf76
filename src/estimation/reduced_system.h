// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimation/graph.h"
#include "estimation/shared_information.h"
#include "estimation/tridiagonal_chain.h"

namespace truetriad {

// The graph linearised at its current state, with the poses eliminated by our own Schur
// complement. What ceres::Covariance would give where it can, plus what it cannot: projections of
// residuals, variance components, rank-deficient systems.
//
// A factor has rows r + J t + A p (t: free shared coordinates, p: the tangent spaces of the poses
// that it sees, one, or two neighbours) with covariance V. Eliminating the poses projects the rows
// of all factors,
//
//   D = V^-1 - V^-1 A (A^T V^-1 A)^-1 A^T V^-1
//
// so that the reduced information is M = prior + J^T D J, and with the whole system's projector
// P = V^-1 - V^-1 H (H^T V^-1 H)^-1 H^T V^-1 (H: all columns)
//
//   P = D - D J M^-1 J^T D        P r = D (r + J step).
//
// Only the blocks of one factor are ever formed: A^T V^-1 A is block tridiagonal, and everything
// is linear in the number of poses.
class ReducedSystem {
 public:
  struct Factor {
    std::size_t node = 0;  // the pose that it sees, or the first of the two
    PoseResidual12 residual;
    PoseRows J;
    PoseStateJacobian A;
    PoseStateJacobian A_next;   // of the next pose; no columns where that is not seen
    PoseRowMatrix information;  // V^-1
    PoseRowMatrix D;            // its own block of D
    PoseRows B;                 // its rows of D J
    PoseResidual12 projected;   // its rows of P r
  };

  // Linearises all factors: those of the poses in their order, then the increments in theirs.
  explicit ReducedSystem(const PoseGraph& graph);

  // Eliminates with the variances and weights the graph has now. Cheap against the constructor; may
  // be called again after the variances changed.
  void Eliminate(const PoseGraph& graph);

  const std::vector<Factor>& factors() const { return factors_; }

  // M and what follows from it.
  const SharedInformation& shared() const { return shared_; }
  int size() const { return shared_.size(); }
  const Eigen::MatrixXd& information() const { return shared_.matrix(); }
  const Eigen::MatrixXd& covariance() const { return shared_.covariance(); }
  const Eigen::VectorXd& scale() const { return shared_.scale(); }
  int rank() const { return shared_.rank(); }
  const Eigen::VectorXd& step() const { return shared_.step(); }

  // The factor's own block of P.
  Eigen::MatrixXd ProjectorBlock(std::size_t factor) const;

  // D y, for any number of columns; rows of each factor by themselves.
  std::vector<PoseRows> Project(const std::vector<PoseRows>& y) const;

  // Own blocks of dD = -D dV D, for a change of the variance of each factor.
  std::vector<PoseRowMatrix> ProjectorDerivative(const std::vector<PoseRowMatrix>& dV) const;

 private:
  Eigen::MatrixXd PoseRightSide(const std::vector<PoseRows>& weighted) const;
  void FormChain();

  std::vector<Factor> factors_;
  std::vector<int> tangent_sizes_;
  TridiagonalChain chain_;
  SharedInformation shared_;
  Eigen::MatrixXd prior_information_;
  Eigen::VectorXd prior_gradient_;
};

}  // namespace truetriad
