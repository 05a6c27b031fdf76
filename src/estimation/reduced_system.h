// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "estimation/graph.h"
#include "estimation/row_products.h"
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
  using PoseColumns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, 6>;

  struct Factor {
    std::size_t node = 0;       // the pose that it sees, or the first of the two
    Eigen::Index row = 0;       // where its rows begin among those of all factors
    PoseColumns A;              // of its pose, and of the next where that is seen
    Eigen::Index own = 0;       // columns of A that belong to its pose
    PoseRowMatrix information;  // V^-1
    PoseColumns weighted;       // V^-1 A
    PoseRowMatrix D;            // its own block of D

    Eigen::Index rows() const { return A.rows(); }
  };

  // Three rows of a factor that have one variance, and what that changes by.
  struct VarianceChange {
    std::size_t factor = 0;
    Eigen::Index row = 0;  // of the factor's
    Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
  };

  // Linearises all factors: those of the poses in their order, then the increments in theirs.
  explicit ReducedSystem(const PoseGraph& graph);

  // Eliminates with the variances and weights the graph has now. Cheap against the constructor; may
  // be called again after the variances changed.
  void Eliminate(const PoseGraph& graph);

  const std::vector<Factor>& factors() const { return factors_; }

  // Rows of all factors: residuals r, J, B = D J, B M^-1 and the projected residuals P r.
  const Eigen::VectorXd& residual() const { return residual_; }
  auto J() const { return columns_.leftCols(size()); }
  auto B() const { return projected_columns_.leftCols(size()); }
  const StackedRows& BM() const { return BM_; }
  const Eigen::VectorXd& projected() const { return projected_; }

  // M and what follows from it.
  const SharedInformation& shared() const { return shared_; }
  int size() const { return shared_.size(); }
  const Eigen::MatrixXd& information() const { return shared_.matrix(); }
  const Eigen::MatrixXd& covariance() const { return shared_.covariance(); }
  const Eigen::VectorXd& scale() const { return shared_.scale(); }
  int rank() const { return shared_.rank(); }
  const Eigen::VectorXd& step() const { return shared_.step(); }

  // The Gauss-Newton step of all poses that goes with it, tangent space after tangent space.
  Eigen::VectorXd PoseSteps() const;

  // The block of P that belongs to three rows of a factor.
  Eigen::Matrix3d ProjectorBlock(std::size_t factor, Eigen::Index row = 0) const;

  // D y, for any number of columns.
  StackedRows Project(const StackedRows& y) const;

  // The blocks of dD = -D dV D at the places of `wanted`, one for each; what those change is not
  // looked at.
  std::vector<Eigen::Matrix3d> ProjectorDerivative(const std::vector<VarianceChange>& dV,
                                                   const std::vector<VarianceChange>& wanted) const;

 private:
  Eigen::Index PoseRow(const Factor& factor) const { return chain_.offset(factor.node); }
  void FormChain();

  std::vector<Factor> factors_;
  StackedRows columns_;            // J, r
  StackedRows projected_columns_;  // D J, D r
  StackedRows BM_;
  Eigen::VectorXd residual_, projected_;
  std::vector<int> tangent_sizes_;
  TridiagonalChain chain_;
  SharedInformation shared_;
  Eigen::MatrixXd prior_information_;
  Eigen::VectorXd prior_gradient_;
};

}  // namespace truetriad
