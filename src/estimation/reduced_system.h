// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimation/graph.h"

namespace truetriad {

// The graph linearised at its current state, with the poses eliminated by our own Schur
// complement. What ceres::Covariance would give where it can, plus what it cannot: projections of
// residuals, variance components, rank-deficient systems.
//
// One pose has rows r + J t + A p (t: free shared coordinates, p: the pose's tangent space) with
// covariance V. Eliminating p projects its rows:
//
//   D = V^-1 - V^-1 A (A^T V^-1 A)^-1 A^T V^-1
//
// so that the reduced information is M = prior + sum J^T D J, and with the whole system's projector
// P = V^-1 - V^-1 H (H^T V^-1 H)^-1 H^T V^-1 (H: all columns) the blocks of P and P r are
//
//   P_kk = D_k - D_k J_k M^-1 J_k^T D_k        (P r)_k = D_k (r_k + J_k step).
class ReducedSystem {
 public:
  struct Pose {
    PoseResidual12 residual;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, Eigen::Dynamic> J;
    PoseStateJacobian A;
    PoseRowMatrix D;
    PoseResidual12 projected;  // (P r)_k
  };

  // Linearises all poses.
  explicit ReducedSystem(const PoseGraph& graph);

  // Eliminates with the variances and weights the graph's nodes have now. Cheap against the
  // constructor; may be called again after the variances changed.
  void Eliminate(const PoseGraph& graph);

  int size() const { return static_cast<int>(information_.rows()); }
  const std::vector<Pose>& poses() const { return poses_; }

  // M, in free coordinates.
  const Eigen::MatrixXd& information() const { return information_; }
  // M^-1; a direction that is not determined (see `rank`) has zero variance here.
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  // Eigenvalues of M in typical units (TypicalSizes), ascending, and their vectors.
  const Eigen::VectorXd& eigenvalues() const { return eigenvalues_; }
  const Eigen::MatrixXd& eigenvectors() const { return eigenvectors_; }
  // Typical size of each free coordinate.
  const Eigen::VectorXd& scale() const { return scale_; }
  int rank() const { return rank_; }
  // The Gauss-Newton step in free coordinates; near zero at the optimum.
  const Eigen::VectorXd& step() const { return step_; }

  // P_kk of one pose.
  Eigen::MatrixXd ProjectorBlock(std::size_t pose) const;

 private:
  std::vector<Pose> poses_;
  Eigen::VectorXd scale_;
  Eigen::MatrixXd prior_information_;
  Eigen::VectorXd prior_gradient_;
  Eigen::MatrixXd information_, covariance_, eigenvectors_;
  Eigen::VectorXd eigenvalues_, step_;
  int rank_ = 0;
};

}  // namespace truetriad
